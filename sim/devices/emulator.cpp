#include "sim/devices/emulator.hpp"

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
    const ByteView chunk = bytes.first(std::min(next_piece(), bytes.size()));
    bytes = bytes.subspan(chunk.size());
    out(chunk);
  }
}

void FrameEmulator::pass_over(std::size_t bytes) {
  while (largest_chunk_bytes_ > 0 && bytes > 0) bytes -= std::min(next_piece(), bytes);
}

namespace {
/// Bytes that a stalled link holds; more are lost, as in a full buffer.
constexpr std::size_t most_held = 4096;
}  // namespace

FaultyWire::FaultyWire(std::unique_ptr<Emulator> inner, FaultBoard& board, Kind kind, TimePoint now)
    : inner_(std::move(inner)), board_(&board), kind_(kind), now_(now) {
  from_inner_ = [this](ByteView bytes) { pass(to_host_, bytes, now_); };
}

void FaultyWire::receive(ByteView bytes, TimePoint now, ByteSink& out) {
  wake(now, out);
  if (is_sound()) return inner_->receive(bytes, now, out);
  pass(to_device_, bytes, now);
}

void FaultyWire::wake(TimePoint now, ByteSink& out) {
  now_ = now;
  out_ = &out;
  if (is_sound()) return inner_->wake(now, out);
  release(now);
  inner_->wake(now, from_inner_);
}

std::optional<TimePoint> FaultyWire::next_wakeup() const {
  if (is_sound()) return inner_->next_wakeup();
  std::optional<TimePoint> next = inner_->next_wakeup();
  const auto sooner = [&](std::optional<TimePoint> at) {
    if (at && (!next || *at < *next)) next = at;
  };
  if (!held_.empty()) sooner(held_.front().due);
  sooner(board_->next_edge(now_));
  return next;
}

void FaultyWire::pass(Way& way, ByteView bytes, TimePoint now) {
  if (is_sound()) return deliver(way.to_device, bytes, now);
  if (board_->active(FaultKind::unplug, now) != nullptr) return;
  if (board_->fires(FaultKind::drop, now, way.to_device) != nullptr) return;
  Bytes message(bytes.begin(), bytes.end());
  damage(way, message, now);
  const bool twice = board_->fires(FaultKind::duplicate, now, way.to_device) != nullptr;
  const TimePoint at = due(way, now);
  for (int copy = 0; copy < (twice ? 2 : 1); ++copy) {
    if (at <= now)
      deliver(way.to_device, message, now);
    else
      hold({at, way.to_device, message});
  }
}

void FaultyWire::damage(const Way& way, Bytes& message, TimePoint now) {
  Random& dice = board_->dice();
  if (message.size() > 1 && board_->fires(FaultKind::truncate, now, way.to_device) != nullptr)
    message.resize(1 + dice.bits() % (message.size() - 1));
  if (!message.empty() && board_->fires(FaultKind::bit_flip, now, way.to_device) != nullptr) {
    const std::size_t bit = dice.bits() % (8 * message.size());
    message[bit / 8] = static_cast<std::uint8_t>(message[bit / 8] ^ (1U << (bit % 8)));
  }
  if (const Fault* more = board_->fires(FaultKind::garbage, now, way.to_device)) {
    const auto most = static_cast<std::uint64_t>(std::clamp(more->amount, 1.0, 4096.0));
    for (std::uint64_t left = 1 + dice.bits() % most; left > 0; --left)
      message.push_back(static_cast<std::uint8_t>(dice.bits()));
  }
}

/// Arrival time of a message that is sent now.
TimePoint FaultyWire::due(Way& way, TimePoint now) {
  if (const Fault* late = board_->fires(FaultKind::reorder, now, way.to_device))
    return now + from_seconds(late->amount);
  TimePoint at = now;
  if (const Fault* stalled = board_->active(FaultKind::link_stall, now, way.to_device))
    at = stalled->until;
  if (const Fault* late = board_->active(FaultKind::delay, now, way.to_device))
    at = std::max(at, now + from_seconds(late->amount));
  if (const Fault* late = board_->fires(FaultKind::jitter, now, way.to_device))
    at = std::max(at, now + from_seconds(late->amount * board_->dice().uniform()));
  if (const Fault* lumps = board_->active(FaultKind::merge, now, way.to_device)) {
    const std::int64_t period = std::max<std::int64_t>(from_seconds(lumps->amount).count(), 1);
    at = std::max(at, TimePoint(Duration((ns_of(now) / period + 1) * period)));
  }
  if (kind_ == Kind::stream) way.last_due = at = std::max(at, way.last_due);
  return at;
}

void FaultyWire::hold(Held held) {
  if (held_.size() >= most_held) return;
  const auto after = std::upper_bound(held_.begin(), held_.end(), held.due,
                                      [](TimePoint at, const Held& h) { return at < h.due; });
  held_.insert(after, std::move(held));
}

/// On a stream, bytes that are due together arrive in one piece.
void FaultyWire::release(TimePoint now) {
  const auto freed = [&](const Held& held) {  // the stall that held it was cleared
    return held.due == TimePoint::max() &&
           board_->active(FaultKind::link_stall, now, held.to_device) == nullptr;
  };
  for (Held& held : held_)
    if (freed(held)) held.due = now;
  while (!held_.empty() && held_.front().due <= now) {
    Held first = std::move(held_.front());
    held_.pop_front();
    while (kind_ == Kind::stream && !held_.empty() && held_.front().due <= now &&
           held_.front().to_device == first.to_device) {
      const Bytes& more = held_.front().bytes;
      first.bytes.insert(first.bytes.end(), more.begin(), more.end());
      held_.pop_front();
    }
    if (board_->active(FaultKind::unplug, now) == nullptr)
      deliver(first.to_device, first.bytes, now);
  }
}

void FaultyWire::deliver(bool to_device, ByteView bytes, TimePoint now) {
  const bool one_by_one =
      !board_->faults().empty() && board_->active(FaultKind::split, now, to_device) != nullptr;
  const std::size_t piece = one_by_one ? 1 : std::max<std::size_t>(bytes.size(), 1);
  do {
    const ByteView part = bytes.first(std::min(piece, bytes.size()));
    bytes = bytes.subspan(part.size());
    if (to_device)
      inner_->receive(part, now, from_inner_);
    else
      (*out_)(part);
  } while (!bytes.empty());
}

}  // namespace weft::sim
