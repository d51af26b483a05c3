#pragma once
// What drivers of sensors that stream do alike: arming, coming to rest, the count of damaged
// frames.

#include <cstdint>
#include <string_view>

#include "drivers/api/driver_base.hpp"
#include "drivers/api/timer.hpp"

namespace weft {

/// Base for drivers of sensors that take no commands. A driver that inherits it writes open(),
/// received() and what it waits for.
class ListeningDriver : public DriverBase {
 public:
  /// `device` with its article, "a tactile array"; must outlive the driver.
  ListeningDriver(DriverHost& driver_host, std::string_view device)
      : DriverBase(driver_host),
        device_(device),
        silence_(driver_host.loop(), [this] { on_silence(); }) {}

  /// Armed when the driver says so with be_armed().
  Status arm() noexcept final;
  /// Errors: wrong_state, unsupported: there is nothing to command.
  Result<std::uint32_t> command(const Command& command) noexcept final;
  /// Ends publishing: armed -> open.
  void stop() noexcept final;
  void close() noexcept final;

 protected:
  /// Arming has begun: wait for frames.
  virtual void await_frames() = 0;
  /// Nothing came as long as silence() expects it.
  virtual void on_silence() = 0;
  /// Stop all waiting but that of silence().
  virtual void stop_waiting() noexcept {}

  /// Awaits what the device sends by itself.
  [[nodiscard]] Watchdog& silence() { return silence_; }
  [[nodiscard]] bool arming() const { return arming_; }
  void be_armed();
  /// Once open, on a good frame: armed if that is under way, and the next frame awaited. False
  /// while nothing is to be published.
  bool advance(Duration stale_after);
  /// So many more frames could not be used. Logged when damage begins, and then once a second.
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
