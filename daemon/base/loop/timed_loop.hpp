#pragma once
// Tells where the wall time of a virtual run goes: a view of a loop that times the callbacks set
// through it.

#include "drivers/api/loop.hpp"

namespace weft::daemon {

/// Times one callback in `stride` and scales, so that measuring stays well under the work measured.
class TimedLoop final : public Loop {
 public:
  explicit TimedLoop(Loop& inner) : inner_(&inner) {}
  [[nodiscard]] TimePoint now() const override { return inner_->now(); }
  TimerId at(TimePoint when, Callback callback) override;
  void cancel(TimerId id) override { inner_->cancel(id); }

  /// Estimated seconds spent in callbacks so far.
  [[nodiscard]] double seconds() const { return std::chrono::duration<double>(spent_).count(); }

 private:
  static constexpr unsigned stride = 16;
  Loop* inner_;
  unsigned count_ = 0;
  std::chrono::nanoseconds spent_{};
};

}  // namespace weft::daemon
