#pragma once
// The choice among learners that were tried on the same trials.

#include <cstddef>
#include <vector>

namespace weft::classifier {

/// How often each trial was got wrong, in all rounds of a cross-validation.
using TimesWrong = std::vector<std::size_t>;

/// Rounds over new folds that a choice takes: five below a hundred trials, else one. How few
/// trials happen to fall to folds weighs more than what separates the learners: over eight seeds
/// LDA on ranks got 0 to 7 of the 54 training strokes of fabricslide at 10 mm/s wrong.
std::size_t choice_rounds(std::size_t trials);

/// In all.
std::size_t times_wrong(const TimesWrong& wrong);

/// Two learners disagree about more + fewer trials, and one of them is wrong on `more` of these:
/// the probability that a fair coin gives the other side at most `fewer` (one-sided sign test,
/// McNemar's without its approximation); 1/2 where `more` is not the larger.
double sign_test(std::size_t more, std::size_t fewer);

/// The first candidate, simple ones first, whose errors exceed those of the best by no more than
/// one standard deviation, by a sign test on the trials that the two got wrong unequally often; the
/// best is the first with the fewest errors. That is Breiman's rule of one standard error (Breiman
/// et al. 1984, section 3.4.3) for learners tried on the same trials. `wrong`: of each candidate;
/// the first has all trials, and one with fewer was dropped and is passed over.
std::size_t first_not_clearly_worse(const std::vector<TimesWrong>& wrong);

}  // namespace weft::classifier
