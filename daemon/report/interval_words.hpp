#pragma once
// What an interval is of, where the classifier cannot know.

#include "classifier/evaluate/interval.hpp"

namespace weft::daemon {

/// The splits leave one group out in turn: corrects what split_interval() says of random ones.
/// Wilson's intervals stay as they are, those of splits that all agree among them.
void name_groups_left_out(classifier::Interval& interval);

}  // namespace weft::daemon
