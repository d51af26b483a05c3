#include "daemon/campaign/simulated_bench.hpp"
#include "daemon/base/file/read_file.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace weft::daemon {
namespace {

// One USB or network hop; a real FTDI chip holds small packets up to 16 ms unless told otherwise,
// its latency timer is set to 1 ms by the drivers' start-up.
constexpr Duration link_latency = std::chrono::milliseconds(1);

/// Records of a stream that a driver makes one sample of: `average`, where its configuration has
/// it.
double records_per_sample(const DeviceEntry& device) {
  const auto config = nlohmann::json::parse(device.config_json, nullptr, false);
  const auto average = nlohmann::json::json_pointer("/average");
  const bool has_average =
      config.is_object() && config.contains(average) && config[average].is_number();
  return has_average ? config[average].get<double>() : 1;
}

}  // namespace

Result<std::unique_ptr<SimulatedBench>> SimulatedBench::create(const RigFile& rig_file,
                                                               std::string_view fabrics_json,
                                                               std::uint64_t seed) {
  auto made = std::make_unique<SimulatedBench>();
  Result<std::unique_ptr<sim::Rig>> rig = sim::Rig::create(rig_file.text, fabrics_json, seed);
  if (!rig) return pass(rig.error());
  made->rig = std::move(*rig);
  const LinkFactory links = [&made](const DeviceEntry& entry) -> Result<std::unique_ptr<Link>> {
    auto [host, device] = MemoryLink::make_pair(made->host_time, made->rig_time, link_latency);
    if (Status ok = made->rig->attach(entry.name, *device, made->rig_time); !ok)
      return pass(ok.error());
    made->far_ends.push_back(std::move(device));
    return std::unique_ptr<Link>(std::move(host));
  };
  const LinkFactory pages = [&made](const DeviceEntry& entry) -> Result<std::unique_ptr<Link>> {
    auto [host, device] = MemoryLink::make_pair(made->host_time, made->rig_time, link_latency);
    if (Status ok = made->rig->attach_page(entry.name, *device, made->rig_time); !ok)
      return pass(ok.error());
    made->far_ends.push_back(std::move(device));
    return std::unique_ptr<Link>(std::move(host));
  };
  Result<std::unique_ptr<Bench>> bench = Bench::create(rig_file, made->host_time, links, pages);
  if (!bench) return pass(bench.error());
  made->bench = std::move(*bench);
  return made;
}

Status same_rates(const RigFile& rig, const recipes::RigLimits& limits, const sim::Rig& emulated) {
  constexpr double tolerance = 1e-3;
  for (std::size_t i = 0; i < rig.devices.size(); ++i) {
    const DeviceEntry& device = rig.devices[i];
    const std::optional<double> sent_hz = emulated.stream_rate_hz(device.name);
    if (!sent_hz) continue;
    const double average_hz =
        (device.role == "wrench" ? limits.wrench_rate_hz : limits.taxel_rate_hz) *
        records_per_sample(device);
    if (std::abs(average_hz - *sent_hz) <= tolerance * *sent_hz) continue;
    return fail({.code = Errc::invalid_argument,
                 .where = "/devices/" + std::to_string(i) + "/config/rate_hz",
                 .what = "driver and emulator disagree on the rate",
                 .expected = std::to_string(*sent_hz) + " Hz, as the emulator sends",
                 .got = std::to_string(average_hz) + " Hz",
                 .hint = "Change one of them"});
  }
  return {};
}

Result<std::string> read_fabrics(const RigFile& rig_file, const std::filesystem::path& rig_path) {
  const auto root = nlohmann::json::parse(rig_file.text, nullptr, false);
  const auto pointer = nlohmann::json::json_pointer("/simulation/fabrics");
  if (root.is_discarded() || !root.contains(pointer) || !root[pointer].is_string())
    return fail({.code = Errc::invalid_argument,
                 .where = rig_path.string() + ": /simulation/fabrics",
                 .what = "the rig file names no cloth table",
                 .expected = "a path relative to the rig file"});
  return read_text_file(rig_path.parent_path() / root[pointer].get<std::string>());
}

}  // namespace weft::daemon
