#pragma once
// The state machine of one tactile array.

#include "drivers/api/driver_base.hpp"
#include "drivers/api/timer.hpp"
#include "drivers/taxel_array/frame_watch.hpp"
#include "drivers/taxel_array/settings.hpp"
#include "protocols/taxel/taxel.hpp"

namespace weft::drivers {

/// Publishes each frame as a TaxelSample. The sensor sends without being asked, so this driver only
/// listens. Nothing allocates while streaming.
class TaxelDriver final : public DriverBase {
 public:
  TaxelDriver(const TaxelSettings& settings, DriverHost& driver_host);

  /// Open when the first good frame has come.
  Status open() noexcept override;
  /// Armed when the next good frame has come.
  Status arm() noexcept override;
  /// Errors: wrong_state, unsupported: there is nothing to command.
  Result<std::uint32_t> command(const Command& command) noexcept override;
  /// Ends publishing: armed -> open.
  void stop() noexcept override;
  void close() noexcept override;

 private:
  void received(ByteView bytes, TimePoint arrival) override;
  void make_safe() noexcept override;

  void take_stream(ByteView bytes, TimePoint arrival);
  void take_datagram(ByteView datagram, TimePoint arrival);
  void on_frame(TimePoint arrival);
  std::optional<std::uint32_t> count_lost();
  bool came_late();
  bool advance();
  void publish(std::uint32_t lost, TimePoint arrival);
  void report_damage(TimePoint arrival);
  void on_silence();
  void rest();

  TaxelSettings settings_;
  protocols::taxel::Splitter splitter_;
  protocols::taxel::SequenceTracker sequence_;
  protocols::taxel::Frame frame_;
  FrameWatch watch_;
  std::uint32_t last_device_us_ = 0;
  std::uint64_t late_ = 0;  ///< frames that came twice or late
  std::uint16_t last_late_ = 0;
  int late_in_a_row_ = 0;  ///< each the next of the one before
  bool arming_ = false;

  std::uint64_t damaged_ = 0;  ///< frames or datagrams that could not be used
  std::uint64_t damaged_reported_ = 0;
  TimePoint damage_reported_at_{};

  Watchdog silence_;
};

}  // namespace weft::drivers
