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
  /// Fz of the sample = sign_z * Fz of the device. +1 if pushing the plate down is positive.
  double sign_z = 1;
  std::array<double, 3> rated_force_n{40, 40, 120};  ///< Mini40 SI-40-2, weak source
  Duration reply_timeout{};                          ///< per opening request
  Duration stale_after{};
  /// True if the configuration gives counts per newton (metre): a page that differs is an error.
  /// Otherwise the values of the page apply.
  bool force_scale_given = false;
  bool torque_scale_given = false;
  std::string calibration_serial;  ///< compared with that of the page; empty: any
  double rate_hz = 100;
  Duration stuck_after{};  ///< constant values for this duration are a fault; zero: never
};

/// JSON Schema of the configuration.
extern const char netft_config_schema[];

/// Errors: parse, invalid_argument, range; each at its JSON pointer.
Result<NetftSettings> read_netft_settings(std::string_view config_json);

/// Driver for an ATI force/torque sensor behind a Net F/T box; see README.md.
extern const DriverEntry ati_netft_entry;

/// Publishes each record of the stream as a WrenchSample in SI. Duplicate and late records are
/// dropped. `lost` is the number of records missing before one. Does not allocate while streaming.
class NetftDriver final : public DriverBase {
 public:
  NetftDriver(const NetftSettings& settings, DriverHost& driver_host);

  /// Becomes open with the answer to a one-sample request. If the host has an HTTP port, the pages
  /// of the box are read first and must agree with the configuration.
  Status open() noexcept override;
  /// Becomes armed with the first record of the stream.
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
  bool streaming_ = false;  ///< a start request was sent
  bool overrange_ = false;  ///< logged once per episode
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
