#include "drivers/ati_digital/exchange.hpp"

#include <array>
#include <string>
#include <utility>

namespace weft::drivers {

namespace modbus = protocols::modbus;

namespace {

tl::unexpected<Error> refusal(const modbus::Exception& exception) {
  return fail({.code = Errc::device_refused,
               .what = "request refused by the sensor",
               .expected = "a reply",
               .got = "exception " + std::to_string(static_cast<int>(exception.code)) + ", " +
                      std::string(to_string(exception.code))});
}

tl::unexpected<Error> silence(Duration timeout, int tries) {
  return fail({.code = Errc::timeout,
               .what = "no reply from the force/torque sensor",
               .expected = "a reply within " + std::to_string(to_seconds(timeout)) + " s",
               .got = "nothing after " + std::to_string(tries) + " requests",
               .hint = "Check power, cable, speed and parity of the line, and the Modbus address"});
}

}  // namespace

Exchange::Exchange(Loop& loop, const ExchangeSettings& settings, Send send)
    : settings_(settings),
      send_(std::move(send)),
      splitter_(modbus::Side::replies, settings.slave),
      quiet_(loop, [this] { on_quiet_time(); }),
      reply_(loop, [this] { on_no_reply(); }) {}

void Exchange::hush(Quiet done) {
  quiet_done_ = std::move(done);
  hushes_ = 0;
  jam();
}

void Exchange::jam() {
  static constexpr std::array<std::uint8_t, jam_bytes> zeros{};
  ++hushes_;
  received_ = false;
  zeros_ = 0;
  quiet_.start(quiet_time);
  send_(zeros);
}

void Exchange::on_quiet_time() {
  if (received_ && hushes_ < most_hushes) return jam();
  if (!received_ && zeros_ == jam_bytes) echoes_ = true;
  const Quiet done = std::exchange(quiet_done_, {});
  splitter_.clear();
  if (!done) return;
  if (!received_) return done({});
  done(fail({.code = Errc::timeout,
             .what = "sensor does not stop sending",
             .expected = "a quiet line",
             .got = "bytes after " + std::to_string(hushes_) + " attempts to stop it",
             .hint = "Check that the port is right and that its speed fits the sensor"}));
}

void Exchange::send_request(const modbus::Request& request, Done done) {
  request_ = request;
  done_ = std::move(done);
  tries_ = 0;
  write_request();
}

void Exchange::write_request() {
  ++tries_;
  sent_.clear();
  append_rtu(sent_, settings_.slave, request_);
  echoed_ = 0;
  awaits_echo_ = true;
  splitter_.clear();
  reply_.start(settings_.reply_timeout);
  send_(sent_);
}

void Exchange::cancel() {
  done_ = {};
  quiet_done_ = {};
  quiet_.cancel();
  reply_.cancel();
  splitter_.clear();
}

void Exchange::received(ByteView bytes) {
  if (quiet_.pending()) return note_while_quiet(bytes);
  if (!done_) return;
  splitter_.push(without_echo(bytes));
  while (done_ && !quiet_.pending()) {
    const std::optional<ByteView> pdu = splitter_.next();
    if (!pdu) return;
    const Result<modbus::Reply> reply = modbus::decode_reply(*pdu);
    if (reply && !is_echo(*reply) && modbus::answers(*reply, request_)) on_reply(*reply);
  }
}

/// Notes received bytes while waiting for silence. The echo of jam() does not show that the sensor
/// still sends.
void Exchange::note_while_quiet(ByteView bytes) {
  for (const std::uint8_t byte : bytes)
    if (byte != 0 || ++zeros_ > jam_bytes) received_ = true;
}

/// Skips the echo of the request, after zeros of a late echo of jam(). No answer begins with a
/// complete request. An answer that shares its first bytes is passed on from its beginning.
ByteView Exchange::without_echo(ByteView bytes) {
  while (awaits_echo_ && !bytes.empty()) {
    const std::uint8_t byte = bytes[0];
    if (byte == sent_[echoed_]) {
      awaits_echo_ = ++echoed_ < sent_.size();
      echoes_ = echoes_ || !awaits_echo_;
    } else if (echoed_ > 0 || byte != 0) {
      awaits_echo_ = false;
      splitter_.push(ByteView(sent_).first(echoed_));
      break;
    }
    bytes = bytes.subspan(1);
  }
  return bytes;
}

/// Whether `reply` is the echo of a vendor request after other bytes: the answer of a vendor
/// function has the form of its request.
bool Exchange::is_echo(const modbus::Reply& reply) const {
  const auto* request = std::get_if<modbus::Vendor>(&request_);
  const auto* answer = std::get_if<modbus::Vendor>(&reply);
  return echoes_ && request != nullptr && answer != nullptr && *request == *answer;
}

// A late answer may arrive twice and must not count as the answer to the next request. So the line
// is hushed first, except after a stream start, because hush() would end the stream.
void Exchange::on_reply(const modbus::Reply& reply) {
  reply_.cancel();
  const auto* vendor = std::get_if<modbus::Vendor>(&request_);
  const bool starts = vendor != nullptr && vendor->function == modbus::Function::vendor_stream;
  if (tries_ == 1 || starts) return finish(reply);
  hush([this, reply](const Status& quiet) { quiet ? finish(reply) : finish(pass(quiet.error())); });
}

void Exchange::on_no_reply() {
  if (tries_ >= most_tries) return finish(silence(settings_.reply_timeout, tries_));
  hush([this](const Status& quiet) { quiet ? write_request() : finish(pass(quiet.error())); });
}

void Exchange::finish(const Result<modbus::Reply>& reply) {
  const Done done = std::exchange(done_, {});
  if (!done) return;
  const auto* exception = reply ? std::get_if<modbus::Exception>(&*reply) : nullptr;
  done(exception == nullptr ? reply : Result<modbus::Reply>(refusal(*exception)));
}

}  // namespace weft::drivers
