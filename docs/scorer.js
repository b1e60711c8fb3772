// Search puts pages that teach before pages of results and reference.
var Scorer = {
  score: ([page, , , , score]) => score + (/^(start|tutorials\/|howto\/|FIT$|ENSEMBLES$)/.test(page) ? 12 : 0),
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
