#include "daemon/hardware/link/memory_link.hpp"

#include <array>
#include <deque>
#include <optional>

namespace weft::daemon {

// One direction: bytes in transit, kept in reused buffers so that a long run does not allocate.
struct Direction {
  struct Piece {
    TimePoint arrival;
    Bytes bytes;
  };
  std::deque<Piece> under_way;
  std::vector<Bytes> spare;
  Link::Receiver receiver;
  Link::Closed closed;
  std::optional<TimerId> timer;
};

struct MemoryLink::Shared : std::enable_shared_from_this<Shared> {
  Shared(Loop& first, Loop& second, Duration d) : loops{&first, &second}, latency(d) {}
  /// Requires both loops alive, as stated at make_pair(). A remaining timer would call a destroyed
  /// link.
  ~Shared() {
    for (const int to : {0, 1})
      if (const auto timer = ways[static_cast<std::size_t>(to)].timer) loop(to).cancel(*timer);
  }
  Loop& loop(int side) { return *loops[static_cast<std::size_t>(side)]; }

  void send(int to, ByteView bytes) {
    Direction& way = ways[static_cast<std::size_t>(to)];
    Bytes buffer;
    if (!way.spare.empty()) {
      buffer = std::move(way.spare.back());
      way.spare.pop_back();
    }
    buffer.assign(bytes.begin(), bytes.end());
    way.under_way.push_back({loop(to).now() + latency, std::move(buffer)});
    schedule(to);
  }

  void schedule(int to) {
    Direction& way = ways[static_cast<std::size_t>(to)];
    if (way.timer || way.under_way.empty()) return;
    // A callback of two words needs no allocation.
    way.timer = loop(to).at(way.under_way.front().arrival, [this, to] { deliver(to); });
  }

  void deliver(int to) {
    const auto alive = shared_from_this();  // a receiver may destroy both ends
    Direction& way = ways[static_cast<std::size_t>(to)];
    way.timer.reset();
    while (!way.under_way.empty() && way.under_way.front().arrival <= loop(to).now()) {
      Direction::Piece piece = std::move(way.under_way.front());
      way.under_way.pop_front();
      if (!cut && way.receiver) way.receiver(piece.bytes, piece.arrival);
      way.spare.push_back(std::move(piece.bytes));
    }
    schedule(to);
  }

  void unplug() {
    if (cut) return;
    cut = true;
    for (Direction& way : ways)
      if (const Link::Closed closed = std::exchange(way.closed, {})) {
        closed(Error{.code = Errc::io, .what = "link unplugged"});
      }
  }

  std::array<Loop*, 2> loops;
  Duration latency;
  bool cut = false;
  std::array<Direction, 2> ways;  ///< indexed by the receiving side
};

std::pair<std::unique_ptr<MemoryLink>, std::unique_ptr<MemoryLink>> MemoryLink::make_pair(
    Loop& first, Loop& second, Duration latency) {
  auto shared = std::make_shared<Shared>(first, second, latency);
  return {std::unique_ptr<MemoryLink>(new MemoryLink(shared, 0)),
          std::unique_ptr<MemoryLink>(new MemoryLink(shared, 1))};
}

MemoryLink::~MemoryLink() {
  Direction& mine = shared_->ways[static_cast<std::size_t>(side_)];
  mine.receiver = {};
  mine.closed = {};
}

Status MemoryLink::write(ByteView bytes) {
  if (shared_->cut) return fail({.code = Errc::io, .what = "link unplugged"});
  shared_->send(1 - side_, bytes);
  return {};
}

void MemoryLink::on_receive(Receiver receiver) {
  shared_->ways[static_cast<std::size_t>(side_)].receiver = std::move(receiver);
}

void MemoryLink::on_closed(Closed closed) {
  shared_->ways[static_cast<std::size_t>(side_)].closed = std::move(closed);
}

void MemoryLink::unplug() {
  shared_->unplug();
}

}  // namespace weft::daemon
