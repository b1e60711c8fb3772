// Search puts pages that teach before pages of results and reference, and titles with the words that are looked for before others.
const looked_for = (new URLSearchParams(window.location.search).get("q") ?? "").toLowerCase().split(/\W+/).filter((word) => word.length > 3);
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
