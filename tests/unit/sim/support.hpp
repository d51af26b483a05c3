#pragma once
// A clock, a pipe and a rig for tests: the least that the interfaces allow.

#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/api/link.hpp"
#include "drivers/api/loop.hpp"
#include "sim/rig/rig.hpp"
#include "tests/unit/plant/support.hpp"

namespace weft::sim::test {

/// Virtual time: the next timer, then the clock moves there.
class TestLoop final : public Loop {
 public:
  [[nodiscard]] TimePoint now() const override { return now_; }
  TimerId at(TimePoint when, Callback callback) override {
    timers_.emplace(std::pair(std::max(when, now_), ++last_), std::move(callback));
    return last_;
  }
  void cancel(TimerId id) override {
    std::erase_if(timers_, [id](const auto& timer) { return timer.first.second == id; });
  }
  void run_to(TimePoint end) {
    while (!timers_.empty() && timers_.begin()->first.first <= end) {
      auto timer = timers_.extract(timers_.begin());
      now_ = timer.key().first;
      timer.mapped()();
    }
    now_ = end;
  }
  void run_for(double seconds) { run_to(now_ + from_seconds(seconds)); }

 private:
  TimePoint now_{};
  TimerId last_ = 0;
  std::map<std::pair<TimePoint, TimerId>, Callback> timers_;
};

/// The device's end of a link; the test is the host.
class TestLink final : public Link {
 public:
  explicit TestLink(TestLoop& loop) : loop_(&loop) {}
  Status write(ByteView bytes) override {
    received.insert(received.end(), bytes.begin(), bytes.end());
    pieces.emplace_back(bytes.begin(), bytes.end());
    return {};
  }
  void on_receive(Receiver receiver) override { receiver_ = std::move(receiver); }
  void on_closed(Closed) override {}
  void send(ByteView bytes) {
    if (receiver_) receiver_(bytes, loop_->now());
  }

  Bytes received;             ///< from the device, as a stream
  std::vector<Bytes> pieces;  ///< the same, write by write

 private:
  TestLoop* loop_;
  Receiver receiver_;
};

inline Bytes hex(const std::string& text) {
  Bytes bytes;
  std::istringstream words(text);
  for (std::string word; words >> word;)
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(word, nullptr, 16)));
  return bytes;
}

inline std::string bench17_text() {
  std::ifstream file(std::string(WEFT_SOURCE_DIR) + "/sim/rigs/bench17.json");
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// bench17 with values exchanged, each as JSON text: {"/simulation/slack_mm", "2"}.
std::string bench17_with(const std::vector<std::pair<std::string, std::string>>& changes);

inline std::unique_ptr<Rig> make_rig(const std::string& rig_json, std::uint64_t seed) {
  auto rig = Rig::create(rig_json, fabrics_text(), seed);
  if (!rig) throw std::runtime_error(to_string(rig.error()));
  return std::move(*rig);
}

}  // namespace weft::sim::test
