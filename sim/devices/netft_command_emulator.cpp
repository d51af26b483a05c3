#include "sim/devices/netft_command_emulator.hpp"

#include <algorithm>

namespace weft::sim {

namespace {

namespace rdt = protocols::rdt;

struct Answerer {
  RdtEmulator* box;
  TimePoint now;
  Bytes* out;

  void operator()(const rdt::ReadFt& read) const { append(*out, box->read_ft(read, now)); }
  void operator()(const rdt::ReadCalibration&) const { append(*out, box->calibration_reply(now)); }
  void operator()(const rdt::WriteTransform& write) const {
    const bool taken = box->set_transform(write).has_value();
    append(*out, rdt::WriteReply{rdt::TcpCommand::write_transform, taken ? no_error : refused});
  }
  void operator()(const rdt::WriteCondition& write) const {
    const bool taken = box->set_condition(write).has_value();
    append(*out, rdt::WriteReply{rdt::TcpCommand::write_condition, taken ? no_error : refused});
  }

  static constexpr std::uint8_t no_error = 0, refused = 1;
};

}  // namespace

void NetftCommandEmulator::receive(ByteView bytes, TimePoint now, ByteSink& out) {
  waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
  std::size_t at = 0;
  for (; waiting_.size() - at >= rdt::command_size; at += rdt::command_size)
    answer(ByteView(waiting_).subspan(at, rdt::command_size), now, out);
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(at));
}

void NetftCommandEmulator::answer(ByteView bytes, TimePoint now, ByteSink& out) {
  RdtEmulator* box = box_();
  const auto request = rdt::decode_command(bytes);
  if (box == nullptr || !request) return;
  Bytes reply;
  std::visit(Answerer{box, now, &reply}, *request);
  out(reply);
}

}  // namespace weft::sim
