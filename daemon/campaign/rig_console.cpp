#include "daemon/campaign/rig_console.hpp"

#include <nlohmann/json.hpp>

namespace weft::daemon {
namespace {

using nlohmann::json;
constexpr std::size_t longest_answer = 65536;

Status read_answer(const std::string& line) {
  const json object = json::parse(line, nullptr, false);
  if (!object.is_object())
    return fail({.code = Errc::parse,
                 .where = "console",
                 .what = "weft-rig's answer is not understood",
                 .expected = "an object",
                 .got = line});
  if (object.value("ok", false)) return {};
  return fail({.code = Errc::device_refused,
               .where = "weft-rig",
               .what = object.value("error", "weft-rig gave no reason")});
}

}  // namespace

RigConsole::RigConsole(std::unique_ptr<Link> link) : link_(std::move(link)) {
  link_->on_receive([this](ByteView bytes, TimePoint) { take(bytes); });
  link_->on_closed([this](const Error& why) {
    while (!waiting_.empty()) answer(pass(why, "console"));
  });
}

void RigConsole::mount(std::string_view fabric, std::uint64_t patch_seed, Answer done) {
  send(json{{"order", "mount"}, {"fabric", fabric}, {"patch_seed", patch_seed}}.dump(),
       std::move(done));
}

void RigConsole::inject_fault(std::string_view fault_json, bool ends, Answer done) {
  json order = json::parse(fault_json);
  order["order"] = ends ? "clear" : "fault";
  send(order.dump(), std::move(done));
}

void RigConsole::send(const std::string& order, Answer done) {
  waiting_.push_back(std::move(done));
  const std::string line = order + "\n";
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(line.data());
  if (Status sent = link_->write({bytes, line.size()}); !sent) answer(std::move(sent));
}

void RigConsole::take(ByteView bytes) {
  for (const std::uint8_t byte : bytes) {
    if (byte != '\n') {
      if (line_.size() < longest_answer) line_.push_back(static_cast<char>(byte));
      continue;
    }
    answer(read_answer(line_));
    line_.clear();
  }
}

void RigConsole::answer(Status status) {
  if (waiting_.empty()) return;
  const Answer done = std::move(waiting_.front());
  waiting_.pop_front();
  done(std::move(status));
}

}  // namespace weft::daemon
