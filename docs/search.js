// What a result of the search counts: Sphinx puts this before its own code.
var Scorer = {
  // The page of a name comes first if the name is one of the words that are looked for.
  score: ([page, , , description, score]) => {
    const words = new URLSearchParams(location.search).get("q")?.split(/\W+/) ?? [];
    const name = page.startsWith("api/") && !description && page.split(".").at(-1);
    if (words.includes(name)) return score + 200;
    return name && words.some(word => word.toLowerCase() === name.toLowerCase()) ? score + 100 : score;
  },
  objNameMatch: 11, objPartialMatch: 6, objPrio: {0: 15, 1: 5, 2: -5}, objPrioDefault: 0,
  title: 15, partialTitle: 7, term: 5, partialTerm: 2,
};
