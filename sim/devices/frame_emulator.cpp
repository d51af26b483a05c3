#include "sim/devices/frame_emulator.hpp"

#include <algorithm>

namespace weft::sim {

void FrameEmulator::wake(TimePoint now, ByteSink& out) {
  for (TimePoint at = *next_wakeup(); at <= now; at = *next_wakeup()) act(at, out);
}

bool FrameEmulator::withheld(std::uint64_t number, TimePoint at) const {
  if (active_fault(FaultKind::silent, at) != nullptr) return true;
  return number % 2 == 1 && active_fault(FaultKind::rate_halved, at) != nullptr;
}

std::int64_t FrameEmulator::number_jump(TimePoint at) {
  std::int64_t jump = 0;
  if (const Fault* ahead = active_fault(FaultKind::sequence_jump, at); once(ahead, jumped_))
    jump += static_cast<int>(ahead->amount);
  if (const Fault* back = active_fault(FaultKind::sequence_back, at); once(back, jumped_))
    jump -= static_cast<int>(back->amount);
  return jump;
}

bool FrameEmulator::restarts(TimePoint at) {
  if (!once(active_fault(FaultKind::restart, at), restarted_)) return false;
  power_on_ = at;
  return true;
}

std::uint32_t FrameEmulator::clock_us(TimePoint of, TimePoint at) const {
  Duration passed = of - power_on_;
  if (const Fault* slow = active_fault(FaultKind::half_speed_clock, at))
    passed -= (of - std::max(slow->from, power_on_)) / 2;
  return static_cast<std::uint32_t>(passed.count() / 1000);
}

void FrameEmulator::send_buffer(TimePoint at, ByteSink& out) {
  if (firing_fault(FaultKind::crc_errors, at) != nullptr) buffer_.back() ^= 0x55;
  ByteView bytes = buffer_;
  if (largest_chunk_bytes_ == 0) return out(bytes);
  while (!bytes.empty()) {
    const std::size_t wanted = 1 + chunks_.bits() % largest_chunk_bytes_;
    const ByteView chunk = bytes.first(std::min(wanted, bytes.size()));
    bytes = bytes.subspan(chunk.size());
    out(chunk);
  }
}

}  // namespace weft::sim
