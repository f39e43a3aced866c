// What a result of the search counts: Sphinx puts this before its own code.
var Scorer = {
  // The page of a name comes first if the name is one of the words that are looked for.
  score: ([page, , , , score]) => {
    const words = new URLSearchParams(location.search).get("q")?.toLowerCase().split(/\W+/) ?? [];
    const name = page.startsWith("api/") && page.split(".").at(-1).toLowerCase();
    return words.includes(name) ? score + 100 : score;
  },
  objNameMatch: 11, objPartialMatch: 6, objPrio: {0: 15, 1: 5, 2: -5}, objPrioDefault: 0,
  title: 15, partialTitle: 7, term: 5, partialTerm: 2,
};
