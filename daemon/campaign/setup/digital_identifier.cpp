#include "daemon/campaign/setup/digital_identifier.hpp"

#include "protocols/ati_digital/calibration.hpp"

namespace weft::daemon {

using namespace protocols::ati_digital;
using namespace protocols::modbus;

namespace {
constexpr drivers::ExchangeSettings settings{slave_address, std::chrono::milliseconds(200)};
constexpr int first_calibration = 1;
}  // namespace

DigitalIdentifier::DigitalIdentifier(Loop& loop, drivers::Exchange::Send send, Done done)
    : loop_(&loop),
      done_(std::move(done)),
      exchange_(loop, settings, std::move(send)),
      counting_(loop, [this] { on_counted(); }) {}

void DigitalIdentifier::start() {
  exchange_.hush([this](const Status& quiet) {
    if (!quiet) return done_(pass(quiet.error()));
    request_piece();
  });
}

void DigitalIdentifier::received(ByteView bytes) {
  streaming_ ? on_stream(bytes) : exchange_.received(bytes);
}

void DigitalIdentifier::request_piece() {
  std::size_t piece = 0, read = 0;
  while (read < registers_.size()) read += calibration_pieces[piece++];
  const auto address = static_cast<std::uint16_t>(calibration_address(first_calibration) + read);
  exchange_.send_request(Read{Function::read_holding, address, calibration_pieces[piece]},
                         [this](const Result<Reply>& reply) {
                           if (!reply) return done_(pass(reply.error()));
                           on_registers(std::get<ReadReply>(*reply).registers.view());
                         });
}

void DigitalIdentifier::on_registers(std::span<const std::uint16_t> piece) {
  registers_.insert(registers_.end(), piece.begin(), piece.end());
  if (registers_.size() < calibration_registers) return request_piece();
  // Has the requested number of registers.
  const Calibration calibration = decode_calibration(registers_).value();
  sensor_.calibration_serial = calibration.serial;
  sensor_.part_number = calibration.part_number;
  exchange_.send_request(Vendor{Function::vendor_stream, protocols::ati_digital::start_stream},
                         [this](const Result<Reply>& reply) {
                           if (!reply) return done_(pass(reply.error()));
                           start_stream();
                         });
}

// The stream starts directly after the reply, perhaps in the same bytes.
void DigitalIdentifier::start_stream() {
  streaming_ = true;
  stream_.begin_in_step();
  counting_.start(count_time);
  on_stream(exchange_.rest());
}

void DigitalIdentifier::on_stream(ByteView bytes) {
  stream_.push(bytes);
  StreamRecord record;
  std::uint32_t lost = 0;
  while (stream_.next(record, lost)) {
    last_ = loop_->now();
    if (records_ == 0) first_ = last_;
    records_ += 1 + (records_ == 0 ? 0 : lost);
  }
}

void DigitalIdentifier::on_counted() {
  streaming_ = false;
  if (records_ > 1)
    sensor_.records_per_s = static_cast<double>(records_ - 1) / to_seconds(last_ - first_);
  exchange_.hush([this](const Status& quiet) {
    if (!quiet) return done_(pass(quiet.error()));
    done_(sensor_);
  });
}

}  // namespace weft::daemon
