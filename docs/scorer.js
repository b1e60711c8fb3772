// Search puts pages that teach before pages of results and reference, and titles with the words that are looked for before others.
const looked_for = (new URLSearchParams(window.location.search).get("q") ?? "").toLowerCase().split(/\W+/).filter((word) => word.length > 3);
// Where no page has all words, those with some of them are found, the more the better.
const with_all = Search.performTermsSearch;
Search.performTermsSearch = (words, excluded) => {
  const found = with_all(words, excluded);
  if (found.length || words.size < 2) return found;
  const by_page = new Map();
  for (const word of words)
    for (const result of with_all(new Set([word]), excluded)) {
      const known = by_page.get(result[0]);
      if (known) known[4] += result[4];
      else by_page.set(result[0], result);
    }
  return [...by_page.values()];
};
var Scorer = {
  score: ([page, title, , , score]) =>
    score
    + (/^(start|tutorials\/|howto\/|FIT$|ENSEMBLES$)/.test(page) ? 12 : 0)
    + 8 * looked_for.filter((word) => title.toLowerCase().includes(word)).length,
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
