#pragma once
// One Modbus request and its answer at a time, repeated when it is lost, without waiting anywhere.

#include <functional>

#include "drivers/api/timer.hpp"
#include "protocols/modbus/rtu.hpp"

namespace weft::drivers {

struct ExchangeSettings {
  std::uint8_t slave = 10;
  Duration reply_timeout{};
};

/// The owner passes on what the link delivers and writes what `send` is given. Each request ends in
/// exactly one call of its `done`, unless cancel() comes first.
class Exchange {
 public:
  using Send = std::function<void(ByteView)>;
  using Done = std::function<void(const Result<protocols::modbus::Reply>& reply)>;
  using Quiet = std::function<void(const Status& status)>;

  Exchange(Loop& loop, const ExchangeSettings& settings, Send send);

  /// Ends whatever the sensor is sending, and calls back when the line has been quiet for a while.
  /// Errors: timeout, when it does not fall silent.
  void hush(Quiet done);
  /// The reply is of the request's kind and not an exception. Errors: timeout, after a few tries
  /// with a hush() before each repetition; device, when the sensor refuses, with its reason.
  void send_request(const protocols::modbus::Request& request, Done done);
  void cancel();

  void received(ByteView bytes);
  /// Whether the line gives back what is sent on it, as half-duplex adapters do; what comes back is
  /// skipped.
  [[nodiscard]] bool echoes() const { return echoes_; }
  /// What came behind the last answer.
  [[nodiscard]] ByteView rest() const { return splitter_.rest(); }

  /// Written by hush(): 72 zeros end a stream (device-facts.md, ATI Digital F/T).
  static constexpr std::size_t jam_bytes = 72;
  /// Longer than those zeros take at 19200 baud, 41 ms.
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
  bool received_ = false;  ///< anything but an echo since the line was to be quiet
  std::size_t zeros_ = 0;  ///< of those, what may be the echo of jam()
  Bytes sent_;             ///< the request, whose echo is awaited up to `echoed_`
  std::size_t echoed_ = 0;
  bool awaits_echo_ = false;
  bool echoes_ = false;
  Timer quiet_;
  Timer reply_;
};

}  // namespace weft::drivers
