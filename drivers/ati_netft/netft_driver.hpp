#pragma once
// The state machine of one Net F/T box.

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/api/driver.hpp"
#include "drivers/api/driver_base.hpp"
#include "drivers/api/timer.hpp"
#include "drivers/api/wrench_watch.hpp"
#include "drivers/ati_netft/page_reader.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"
#include "protocols/rdt/rdt.hpp"

namespace weft::drivers {

struct NetftSettings {
  double newton_per_count = 1e-6;
  double newton_metre_per_count = 1e-6;
  /// Fz of the sample = sign_z * Fz of the device. +1 where pushing the plate down is positive.
  double sign_z = 1;
  std::array<double, 3> rated_force_n{40, 40, 120};  ///< Mini40 SI-40-2, weak source
  Duration reply_timeout{};                          ///< of each of a few opening requests
  Duration stale_after{};
  /// The configuration names counts per newton (metre): a page that differs is refused. Otherwise
  /// the page's are taken.
  bool force_scale_given = false;
  bool torque_scale_given = false;
  std::string calibration_serial;  ///< compared with the page's; empty: any
  double rate_hz = 100;
  Duration stuck_after{};  ///< values that stay the same for so long are a fault; zero: never
};

/// JSON Schema of the configuration.
extern const char netft_config_schema[];

/// Errors: parse, invalid_argument, range; each at its JSON pointer.
Result<NetftSettings> read_netft_settings(std::string_view config_json);

/// Driver for an ATI force/torque sensor behind a Net F/T box. One page about it: README.md.
extern const DriverEntry ati_netft_entry;

/// Publishes each record of the stream as a WrenchSample in SI. Records that come twice or too late
/// are dropped; the records missing before one are its `lost`. Nothing allocates while streaming.
class NetftDriver final : public DriverBase {
 public:
  NetftDriver(const NetftSettings& settings, DriverHost& driver_host);

  /// Open when the answer to a one-sample request has come; where the host gives an HTTP port, the
  /// box's pages are read first and must agree with the configuration.
  Status open() noexcept override;
  /// Armed when the first record of the stream has come.
  Status arm() noexcept override;
  /// BiasCommand only. Errors: wrong_state, unsupported.
  Result<std::uint32_t> command(const Command& command) noexcept override;
  /// Ends the stream: armed -> open.
  void stop() noexcept override;
  void close() noexcept override;

 private:
  void received(ByteView datagram, TimePoint arrival) override;
  void make_safe() noexcept override;

  Status request_next();
  void on_pages(const Result<BoxPages>& pages);
  Status agree(const BoxPages& pages);
  Status agree_on_serial(const BoxPages& pages);
  [[nodiscard]] DeviceIdentity identity() const;
  void on_late_record(const protocols::rdt::Record& record);
  void on_record(const protocols::rdt::Record& record, TimePoint arrival);
  void on_opening_timeout();
  void on_stale();
  void on_bad_datagram(const Error& error);
  Sample to_sample(const protocols::rdt::Record& record, std::uint32_t lost, TimePoint arrival);
  bool within_rating(const WrenchSample& wrench);
  bool request(protocols::rdt::RequestCommand command, std::uint32_t sample_count);
  void end_stream();

  NetftSettings settings_;
  protocols::rdt::SequenceTracker sequence_;
  bool streaming_ = false;  ///< a start request went out
  bool overrange_ = false;  ///< said once per episode
  std::uint64_t bad_datagrams_ = 0;
  std::uint64_t late_records_ = 0;
  std::uint32_t late_in_a_row_ = 0;
  std::uint32_t last_late_ = 0;
  int opening_tries_ = 0;
  std::optional<BoxPages> pages_;
  WrenchWatch watch_;
  PageReader reader_;

  Timer opening_;
  Watchdog stale_;
};

}  // namespace weft::drivers
