#pragma once
// One Modbus request and its answer at a time; repeats a lost one. Never blocks.

#include <functional>

#include "drivers/api/timer.hpp"
#include "protocols/modbus/rtu.hpp"

namespace weft::drivers {

struct ExchangeSettings {
  std::uint8_t slave = 10;
  Duration reply_timeout{};
};

/// The owner passes received bytes to received() and writes the bytes that `send` gets. Each
/// request ends in exactly one call of its `done`, unless cancel() comes first.
class Exchange {
 public:
  using Send = std::function<void(ByteView)>;
  using Done = std::function<void(const Result<protocols::modbus::Reply>& reply)>;
  using Quiet = std::function<void(const Status& status)>;

  Exchange(Loop& loop, const ExchangeSettings& settings, Send send);

  /// Ends any transmission of the sensor and calls back after a time of silence. Errors: timeout,
  /// if the line does not become quiet.
  void hush(Quiet done);
  /// The reply has the request's kind and is not an exception. Errors: timeout, after a few tries
  /// with a hush() before each repetition; device_refused, if the sensor refuses, with its reason.
  void send_request(const protocols::modbus::Request& request, Done done);
  void cancel();

  void received(ByteView bytes);
  /// Whether the line echoes sent bytes, as half-duplex adapters do. Echoes are skipped.
  [[nodiscard]] bool echoes() const { return echoes_; }
  /// Bytes received after the last answer.
  [[nodiscard]] ByteView rest() const { return splitter_.rest(); }

  /// Written by hush(): 72 zeros end a stream (device-facts.md, ATI Digital F/T).
  static constexpr std::size_t jam_bytes = 72;
  /// Longer than the transmission of those zeros at 19200 baud, 41 ms.
  static constexpr Duration quiet_time = std::chrono::milliseconds(50);
  static constexpr int most_tries = 3;
  static constexpr int most_hushes = 10;

 private:
  void write_request();
  void on_quiet_time();
  void on_no_reply();
  void on_reply(const protocols::modbus::Reply& reply);
  void jam();
  void note_while_quiet(ByteView bytes);
  ByteView without_echo(ByteView bytes);
  bool is_echo(const protocols::modbus::Reply& reply) const;
  void finish(const Result<protocols::modbus::Reply>& reply);

  ExchangeSettings settings_;
  Send send_;
  protocols::modbus::RtuSplitter splitter_;
  protocols::modbus::Request request_;
  Done done_;
  Quiet quiet_done_;
  int tries_ = 0;
  int hushes_ = 0;
  bool received_ = false;  ///< bytes other than an echo since silence began
  std::size_t zeros_ = 0;  ///< received zeros, which may be the echo of jam()
  Bytes sent_;             ///< the request; its echo has arrived up to `echoed_`
  std::size_t echoed_ = 0;
  bool awaits_echo_ = false;
  bool echoes_ = false;
  Timer quiet_;
  Timer reply_;
};

}  // namespace weft::drivers
