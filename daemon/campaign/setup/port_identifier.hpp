#pragma once
// Identifies the device at a port: receives first, then requests its identity. Nothing is set,
// armed or moved.

#include <functional>
#include <memory>
#include <vector>

#include "daemon/campaign/setup/digital_identifier.hpp"
#include "daemon/campaign/setup/found_device.hpp"
#include "protocols/apt/message.hpp"
#include "protocols/imprint/imprint.hpp"
#include "protocols/taxel/taxel.hpp"
#include "protocols/vibro/vibro.hpp"

namespace weft::daemon {

/// One opening of a port with its requests. Each one also detects sensors that send unasked.
struct PortAttempt {
  LinkSettings link;
  bool asks_stage = false;    ///< APT: HW_REQ_INFO
  bool asks_digital = false;  ///< Modbus: status and calibration of a Digital F/T sensor
};

/// Thread-bound to its loop, which outlives it.
class PortIdentifier {
 public:
  /// Receive time: long enough for a sensor that describes itself once a second.
  static constexpr Duration listen_time = std::chrono::milliseconds(1500);

  PortIdentifier(RealLoop& loop, std::string place, std::vector<PortAttempt> attempts);

  /// Starts; done() is true after a few seconds.
  void start();
  [[nodiscard]] bool done() const { return done_; }
  /// Valid once done; the kind is unknown without a reply.
  [[nodiscard]] const FoundDevice& found() const { return found_; }

 private:
  void begin_attempt();
  void begin_listening();
  void end_attempt();
  void finish();
  void on_time();
  void request_info();
  void received(ByteView bytes, TimePoint arrival);
  void receive_stage(ByteView bytes);
  void receive_streams(ByteView bytes);
  void on_info(const protocols::apt::Message& message);
  void on_taxels(const protocols::taxel::Frame& frame);
  void request_digital();

  RealLoop* loop_;
  std::vector<PortAttempt> attempts_;
  std::size_t next_ = 0;  ///< index of the next attempt
  FoundDevice found_;
  bool done_ = false;
  bool is_listening_ = false;  ///< the link is open and its start-up is over
  std::unique_ptr<Link> link_;
  protocols::apt::Splitter apt_;
  protocols::taxel::Splitter taxels_;
  protocols::vibro::Splitter vibro_;
  std::unique_ptr<protocols::imprint::Splitter> imprint_;
  std::size_t frames_ = 0;  ///< of taxels
  std::uint32_t first_us_ = 0, last_us_ = 0;
  std::unique_ptr<DigitalIdentifier> digital_;
  Timer timer_;
};

/// The stages that a controller of this model may have, by the table of protocols/apt. Only the
/// reported stage if the controller reports a `stage_id`.
std::vector<std::string> stages_of_controller(const std::string& model, std::uint16_t stage_id);

/// A measured rate as a person would state it: 499.7 is 500, 36.96 is 37.
double rounded_rate_hz(double measured_hz);

}  // namespace weft::daemon
