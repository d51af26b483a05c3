// Wraps a good driver and does one forbidden thing: {"trouble": "none" | "create" | "open" |
// "received" | "late" | "hang", "after_samples": N, ...the good driver's own settings}.
// WEFT_GOOD_DRIVER names the good one, WEFT_OWN_NAME this one.

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "drivers/api/plugin.hpp"
#include "drivers/taxel_array/taxel_driver.hpp"
#include "drivers/thorlabs_apt/stage_driver.hpp"

namespace weft::drivers {
namespace {

void wait(std::chrono::seconds time) {
  std::mutex mutex;
  std::condition_variable never;
  std::unique_lock lock(mutex);
  never.wait_for(lock, time, [] { return false; });
}

/// Relays between the good driver and its host.
class Misbehaving final : public Driver, public DriverHost {
 public:
  Misbehaving(std::string trouble, int samples, DriverHost& outer)
      : trouble_(std::move(trouble)), samples_left_(samples), outer_(&outer) {}
  Status start(const std::string& config) {
    auto made = WEFT_GOOD_DRIVER.create(config, *this);
    if (!made) return pass(made.error());
    driver_ = std::move(*made);
    return {};
  }

  [[nodiscard]] DriverState state() const noexcept override { return driver_->state(); }
  Status open() override {
    if (trouble_ == "open") throw std::runtime_error("no such thing in open");
    return driver_->open();
  }
  Status arm() override { return driver_->arm(); }
  Result<std::uint32_t> command(const Command& order) override { return driver_->command(order); }
  void stop() override { driver_->stop(); }
  void close() override { driver_->close(); }

  Loop& loop() override { return outer_->loop(); }
  Link& link() override { return outer_->link(); }
  void publish(const Sample& sample) override {
    if (--samples_left_ == 0) make_trouble();
    outer_->publish(sample);
  }
  void identified(const DeviceIdentity& identity) override { outer_->identified(identity); }
  void state_changed(DriverState now) override { outer_->state_changed(now); }
  void fault(const Error& error) override { outer_->fault(error); }
  void log(LogLevel level, std::string_view text) override { outer_->log(level, text); }

 private:
  void make_trouble() {
    if (trouble_ == "received") throw std::runtime_error("one sample too many");
    if (trouble_ == "late") wait(std::chrono::seconds(2));
    if (trouble_ == "hang") wait(std::chrono::hours(1));
  }

  std::string trouble_;
  int samples_left_;
  DriverHost* outer_;
  std::unique_ptr<Driver> driver_;
};

Result<std::unique_ptr<Driver>> create(std::string_view config_json, DriverHost& host) {
  nlohmann::json config = nlohmann::json::parse(config_json);
  const std::string trouble = config.value("trouble", "none");
  const int samples = config.value("after_samples", 1);
  config.erase("trouble");
  config.erase("after_samples");
  if (trouble == "create") throw std::runtime_error("no such thing in create");
  auto made = std::make_unique<Misbehaving>(trouble, samples, host);
  if (Status ok = made->start(config.dump()); !ok) return pass(ok.error());
  return std::unique_ptr<Driver>(std::move(made));
}

}  // namespace

extern const DriverEntry misbehaving_entry;
constinit const DriverEntry misbehaving_entry{
    .name = WEFT_OWN_NAME,
    .summary = "A device whose driver is at fault",
    .config_schema_json = "{}",
    .create = create,
};

}  // namespace weft::drivers

WEFT_EXPORT_DRIVER(weft::drivers::misbehaving_entry);
