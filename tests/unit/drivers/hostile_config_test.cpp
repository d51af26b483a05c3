// Absurd numbers in a driver's configuration, and absurd counts on its link.

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "drivers/ati_digital/digital_driver.hpp"
#include "drivers/ati_netft/netft_driver.hpp"
#include "drivers/taxel_array/taxel_driver.hpp"
#include "drivers/thorlabs_apt/stage_driver.hpp"
#include "drivers/vibro/vibro_driver.hpp"
#include "protocols/rdt/rdt.hpp"
#include "tests/unit/drivers/fakes.hpp"
#include "tests/unit/hostile_json.hpp"

namespace hostile_config_test {

using namespace weft;
using namespace weft::testing;

namespace {

/// The defaults of a driver's schema.
std::string defaults_of(const DriverEntry& entry) {
  nlohmann::json config = nlohmann::json::object();
  const auto schema = nlohmann::json::parse(entry.config_schema_json);
  for (const auto& [key, property] : schema.at("properties").items())
    if (property.contains("default")) config[key] = property.at("default");
  return config.dump();
}

}  // namespace

TEST_CASE("any number of a driver's configuration that is absurd is refused by name, or harmless") {
  for (const DriverEntry* entry :
       {&drivers::thorlabs_apt_entry, &drivers::ati_netft_entry, &drivers::ati_digital_entry,
        &drivers::taxel_array_entry, &drivers::vibro_entry}) {
    int refused = 0;
    hostile::for_each_number(
        defaults_of(*entry), "",
        [&](const std::string& pointer, auto value, const std::string& config) {
          CAPTURE(entry->name, pointer, value);
          FakeHost host;
          const auto made = entry->create(config, host);
          if (made) return static_cast<void>((*made)->open());  // must neither throw nor hang
          ++refused;
          CHECK_FALSE(made.error().what.empty());
          const bool is_json = value.find("999") == std::string_view::npos;
          if (is_json) CHECK(hostile::names_field(made.error().where, pointer));
        });
    CHECK(refused > 5);
  }
}

TEST_CASE("counts at the ends of 32 bits are finite forces that are marked as wrong") {
  constexpr std::int32_t lowest = std::numeric_limits<std::int32_t>::min();
  constexpr std::int32_t highest = std::numeric_limits<std::int32_t>::max();
  for (const char* config : {"{}", R"({"counts_per_newton": 1, "counts_per_newton_metre": 1})"}) {
    FakeHost host;
    auto made = drivers::ati_netft_entry.create(config, host);
    REQUIRE(made);
    const auto receive = [&](std::uint32_t sequence, std::int32_t counts) {
      Bytes datagram;
      append(datagram,
             protocols::rdt::Record{
                 sequence, sequence, 0, {counts, counts, counts}, {counts, counts, counts}});
      host.link_.deliver(datagram, host.loop_.now());
    };
    REQUIRE((*made)->open());
    receive(1, 0);
    REQUIRE((*made)->arm());
    receive(1, 0);
    std::uint32_t sequence = 1;
    for (const std::int32_t counts : {lowest, lowest + 1, highest}) {
      receive(++sequence, counts);
      const auto& sample = std::get<WrenchSample>(host.samples.back().value);
      for (const double force : sample.force_n) CHECK(std::isfinite(force));
      for (const double torque : sample.torque_nm) CHECK(std::isfinite(torque));
      CHECK_FALSE(sample.valid);
    }
  }
}

}  // namespace hostile_config_test
