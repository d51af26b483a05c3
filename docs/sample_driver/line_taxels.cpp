// Driver of a tactile array on a microcontroller that prints lines: "taxels SERIAL" as the reply to
// "?", and one line per frame, "NUMBER,C0,...,C15" (counts 0 to 65535).
#include <array>
#include <charconv>

#include "drivers/api/config.hpp"
#include "drivers/api/driver_base.hpp"
#include "drivers/api/plugin.hpp"
#include "drivers/api/timer.hpp"
#include "protocols/base/sequence.hpp"

namespace {
using namespace weft;

class LineTaxels final : public DriverBase {
 public:
  LineTaxels(Duration stale_after, DriverHost& driver_host)
      : DriverBase(driver_host), stale_after_(stale_after), silence_(driver_host.loop(), [this] {
          raise({.code = Errc::timeout, .what = "array silent", .hint = "Check power and cable"});
        }) {}

  Status open() override {
    if (Status taken = attach(); !taken) return taken;
    silence_.expect_within(stale_after_);
    constexpr std::array<std::uint8_t, 2> who_are_you{'?', '\n'};
    if (!send(who_are_you))
      return fail({.code = Errc::io, .what = "query not sent: the link did not accept it"});
    return {};
  }
  Status arm() override {
    if (Status allowed = require(DriverState::open, "arm"); !allowed) return allowed;
    silence_.expect_within(stale_after_);
    arming_ = true;
    return {};
  }
  Result<std::uint32_t> command(const Command&) override {
    return fail({.code = Errc::unsupported, .what = "commands not supported by a tactile array"});
  }
  void stop() override { make_safe(), enter(LifecycleEvent::disarmed); }
  void close() override { make_safe(), detach(), enter(LifecycleEvent::close); }

 private:
  void make_safe() noexcept override { arming_ = false, silence_.stop(); }

  void received(ByteView bytes, TimePoint arrival) override {
    for (const std::uint8_t byte : bytes) {
      if (byte != '\n' && line_.size() < 200) line_ += static_cast<char>(byte);
      if (byte == '\n') on_line(std::exchange(line_, {}), arrival);
    }
  }
  void on_line(const std::string& line, TimePoint arrival) {
    if (state() == DriverState::closed) return greet(line);
    std::array<std::uint32_t, 17> numbers{};
    if (!read_numbers(line, numbers)) return host().log(LogLevel::warning, "invalid line: " + line);
    if (std::exchange(arming_, false)) enter(LifecycleEvent::armed);
    if (state() != DriverState::armed) return;
    silence_.expect_within(stale_after_);
    std::copy(numbers.begin() + 1, numbers.end(), counts_.begin());
    const std::uint32_t lost = sequence_.observe(numbers[0]).lost;
    host().publish({arrival, numbers[0], lost, TaxelSample{counts_, 0, 0, 0}});
  }
  void greet(const std::string& line) {
    if (line.rfind("taxels ", 0) != 0) return;  // frames of an earlier session
    silence_.stop();
    host().identified({{{"serial", line.substr(7)}}, {}});
    enter(LifecycleEvent::opened);
  }
  static bool read_numbers(const std::string& line, std::array<std::uint32_t, 17>& numbers) {
    const char* at = line.data() - 1;
    const char* const end = line.data() + line.size();
    for (std::uint32_t& number : numbers) {
      const auto read = std::from_chars(at == end ? end : at + 1, end, number);
      if (read.ec != std::errc{} || (number > 65535 && &number != numbers.data())) return false;
      at = read.ptr;
    }
    return at == end;
  }

  Duration stale_after_;
  std::string line_;
  std::array<std::uint16_t, 16> counts_{};
  BasicSequenceTracker<std::uint32_t> sequence_;
  bool arming_ = false;
  Watchdog silence_;
};

Result<std::unique_ptr<Driver>> create(std::string_view json, DriverHost& host) {
  ConfigReader config(json);
  const double rate_hz = config.number("rate_hz", 37, {1, 1000});
  config.integer("taxels", 16, {16, 16});
  if (Status ok = config.finish(); !ok) return pass(ok.error());
  return std::make_unique<LineTaxels>(from_seconds(1 + 10 / rate_hz), host);
}
}  // namespace

extern const DriverEntry line_taxels;
constinit const DriverEntry line_taxels{"line_taxels", "Tactile array, text lines", "{}", create};
WEFT_EXPORT_DRIVER(line_taxels);
