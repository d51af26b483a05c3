#include "daemon/report/interval_words.hpp"

namespace weft::daemon {

void name_groups_left_out(classifier::Interval& interval) {
  if (interval.method.starts_with("Student"))
    interval.method = "Student t with the Nadeau-Bengio variance, over the groups left out";
}

}  // namespace weft::daemon
