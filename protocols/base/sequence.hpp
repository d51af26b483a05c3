#pragma once
// Loss accounting for numbered frames, with wrap-around.

#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>

namespace weft {

enum class SequenceEvent { first, contiguous, gap, duplicate, out_of_order };

struct SequenceStep {
  SequenceEvent event = SequenceEvent::first;
  std::uint32_t lost = 0;  ///< frames missing right before this one; 0 unless the event is gap
};

/// Compares each number with the last one, modulo the counter's width. Numbers up to half the range
/// ahead are newer. An older number is out of order and does not change the tracker.
template <class Unsigned>
class BasicSequenceTracker {
  static_assert(std::is_unsigned_v<Unsigned>);

 public:
  SequenceStep observe(Unsigned number) {
    if (!last_) return accept(number, {SequenceEvent::first, 0});
    const auto ahead = static_cast<Unsigned>(number - *last_);
    if (ahead == 0) return {SequenceEvent::duplicate, 0};
    if (ahead == 1) return accept(number, {SequenceEvent::contiguous, 0});
    if (ahead > std::numeric_limits<Unsigned>::max() / 2) return {SequenceEvent::out_of_order, 0};
    return accept(number, {SequenceEvent::gap, static_cast<std::uint32_t>(ahead - 1)});
  }
  void reset() { last_.reset(); }

 private:
  SequenceStep accept(Unsigned number, SequenceStep step) {
    last_ = number;
    return step;
  }
  std::optional<Unsigned> last_;
};

}  // namespace weft
