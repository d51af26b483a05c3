#pragma once
// Watches a sensor's stream for problems that no single frame shows: constant values, a wrong rate,
// a wrong clock.

#include <cstdint>
#include <optional>
#include <string_view>

#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"

namespace weft::drivers {

/// Filter for wrong values. A value that is wrong in one window may come from a busy machine that
/// catches up; a value that is wrong in two windows in a row is a problem.
class Suspicion {
 public:
  /// True if `seen` is more than a quarter off `expected` (> 0), in this window and in the one
  /// before.
  bool confirmed(double seen, double expected);
  void drop() { windows_ = 0; }

 private:
  int windows_ = 0;  ///< wrong windows in a row
};

struct StreamWatchSettings {
  double rate_hz = 1;              ///< frames per second, lost ones included
  Duration window{};               ///< length of a window; zero: no checks
  std::uint32_t least_frames = 1;  ///< minimum per window
  bool has_clock = true;           ///< frames carry the sensor's own time
  // Code and texts of the error about a wrong rate.
  Errc rate_code = Errc::device_data;
  std::string_view rate_what, rate_unit, rate_hint;
};

/// Counts the frames of a window of time, and checks their rate and the sensor's clock.
class PaceWatch {
 public:
  explicit PaceWatch(const StreamWatchSettings& settings) : settings_(settings) {}

  void restart() { from_.reset(); }

 protected:
  /// Place of a frame in the windows: `first` begins the first window, `last` ends a window and
  /// begins the next.
  enum class Place : std::uint8_t { ignored, first, inside, last };

  /// Counts a frame. `lost`: frames missing before it.
  Place count(std::uint32_t lost, TimePoint arrival);
  void begin_window(std::uint32_t device_us, TimePoint arrival);
  /// Checks the window that ends with this frame. Errors: those of the settings, device_data.
  std::optional<Error> check_pace(std::uint32_t device_us, TimePoint arrival);
  /// Frames in this window.
  [[nodiscard]] std::uint32_t frames() const { return frames_; }

 private:
  StreamWatchSettings settings_;
  std::optional<TimePoint> from_;
  std::uint32_t first_us_ = 0;
  std::uint32_t frames_ = 0;
  double expected_frames_ = 0;  ///< lost ones included
  Suspicion rate_, clock_;
};

/// Pure. Checks one window after the other; allocates only for the error. A derived class selects
/// the values to watch.
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
  /// Called for the first frame of a window.
  virtual void begin(const Frame& frame) = 0;
  virtual void note(const Frame& frame) = 0;
  /// Checks the window that ends with this frame.
  [[nodiscard]] virtual std::optional<Error> check_values(const Frame& frame) const = 0;

 private:
  void begin(const Frame& frame, TimePoint arrival) {
    begin_window(frame.device_us, arrival);
    begin(frame);
  }
};

}  // namespace weft::drivers
