"""What a reader sees: blocks, written as text and as HTML, and numbers as they are shown.

Four words name what turns into letters, each with one meaning. *Words* are a phrase or a sentence,
as `price_words`. A *figure* is a number with its digits, sign and unit, as in `numbers`. A value is
*shown* in a message, short and safe, whatever it is: `optuav.errors.shown`. *Text* is laid out in
lines: `text.as_text` of blocks.
"""
