#pragma once
// Common parts of drivers of streaming sensors: arming, ending, and the count of damaged frames.

#include <cstdint>
#include <string_view>

#include "drivers/api/driver_base.hpp"
#include "drivers/api/timer.hpp"

namespace weft {

/// Base of drivers of sensors that accept no commands. A derived class implements open(),
/// received() and its waiting.
class ListeningDriver : public DriverBase {
 public:
  /// `device`: with its article, "a tactile array"; must outlive the driver.
  ListeningDriver(DriverHost& driver_host, std::string_view device)
      : DriverBase(driver_host),
        device_(device),
        silence_(driver_host.loop(), [this] { on_silence(); }) {}

  /// Becomes armed when the derived class calls be_armed().
  Status arm() noexcept final;
  /// Errors: wrong_state, unsupported: the sensor has no commands.
  Result<std::uint32_t> command(const Command& command) noexcept final;
  /// Ends publishing: armed -> open.
  void stop() noexcept final;
  void close() noexcept final;

 protected:
  /// Called when arming begins: wait for frames.
  virtual void await_frames() = 0;
  /// Called when no frame arrived within the limit of silence().
  virtual void on_silence() = 0;
  /// Stop all waiting except that of silence().
  virtual void stop_waiting() noexcept {}

  /// Watchdog for the frames that the device sends by itself.
  [[nodiscard]] Watchdog& silence() { return silence_; }
  [[nodiscard]] bool arming() const { return arming_; }
  void be_armed();
  /// Call for each good frame once open. Completes arming if it is in progress, and expects the
  /// next frame within `stale_after`. Returns false while frames must not be published.
  bool advance(Duration stale_after);
  /// Adds `frames` invalid frames. Logged when damage begins, then at most once per second.
  void count_damaged(std::uint64_t frames, TimePoint arrival);

 private:
  void make_safe() noexcept final { rest(); }
  void rest() noexcept;

  std::string_view device_;
  Watchdog silence_;
  bool arming_ = false;
  std::uint64_t damaged_ = 0, damaged_reported_ = 0;
  TimePoint damage_reported_at_{};
};

}  // namespace weft
