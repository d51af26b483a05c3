#pragma once
// Watches a sensor's stream for what no single frame shows: values that do not change, another
// rate, a clock that runs wrong.

#include <cstdint>
#include <optional>
#include <string_view>

#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"

namespace weft::drivers {

/// A figure that is wrong in one window may be a machine that was busy and catches up; in two in a
/// row it is believed.
class Suspicion {
 public:
  /// True when `seen` is more than a quarter off `expected` (> 0), as it was in the window before.
  bool confirmed(double seen, double expected);
  void drop() { windows_ = 0; }

 private:
  int windows_ = 0;  ///< in a row
};

struct StreamWatchSettings {
  double rate_hz = 1;              ///< frames a second, lost ones included
  Duration window{};               ///< judged at once; zero: nothing is looked for
  std::uint32_t least_frames = 1;  ///< of a window
  bool has_clock = true;           ///< frames carry the sensor's own time
  // The error about another rate.
  Errc rate_code = Errc::device_data;
  std::string_view rate_what, rate_unit, rate_hint;
};

/// Counts the frames of a window of time, and judges their rate and the sensor's clock.
class PaceWatch {
 public:
  explicit PaceWatch(const StreamWatchSettings& settings) : settings_(settings) {}

  void restart() { from_.reset(); }

 protected:
  /// What a frame is for the windows: the first of the first, one of a window, the last of one.
  enum class Place : std::uint8_t { ignored, first, inside, last };

  /// Counts a frame. `lost`: frames missing before it.
  Place count(std::uint32_t lost, TimePoint arrival);
  void begin_window(std::uint32_t device_us, TimePoint arrival);
  /// Of the window that ends with this frame. Errors: those of the settings, device_data.
  std::optional<Error> check_pace(std::uint32_t device_us, TimePoint arrival);
  /// In this window.
  [[nodiscard]] std::uint32_t frames() const { return frames_; }

 private:
  StreamWatchSettings settings_;
  std::optional<TimePoint> from_;
  std::uint32_t first_us_ = 0;
  std::uint32_t frames_ = 0;
  double expected_frames_ = 0;  ///< lost ones included
  Suspicion rate_, clock_;
};

/// Pure. Judges one window after another; allocates only for the error. A driver says what of its
/// frames' values is watched.
template <class Frame>
class StreamWatch : public PaceWatch {
 public:
  using PaceWatch::PaceWatch;

  /// `lost`: frames missing before this one. Errors: those of check_values() and of the settings,
  /// device_data.
  std::optional<Error> check(const Frame& frame, std::uint32_t lost, TimePoint arrival) {
    const Place place = count(lost, arrival);
    if (place == Place::ignored) return std::nullopt;
    if (place == Place::first) begin(frame, arrival);
    note(frame);
    if (place != Place::last) return std::nullopt;
    auto wrong = check_values(frame);
    if (!wrong) wrong = check_pace(frame.device_us, arrival);
    begin(frame, arrival);
    return wrong;
  }

 protected:
  /// A window begins with this frame.
  virtual void begin(const Frame& frame) = 0;
  virtual void note(const Frame& frame) = 0;
  /// Of the window that ends with this frame.
  [[nodiscard]] virtual std::optional<Error> check_values(const Frame& frame) const = 0;

 private:
  void begin(const Frame& frame, TimePoint arrival) {
    begin_window(frame.device_us, arrival);
    begin(frame);
  }
};

}  // namespace weft::drivers
