#include "sim/rig/rig.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "protocols/base/json_text.hpp"
#include "sim/devices/emulator.hpp"
#include "sim/devices/rdt_emulator.hpp"
#include "sim/devices/replay.hpp"
#include "sim/plant/fabric.hpp"
#include "sim/plant/imprint/objects.hpp"
#include "sim/plant/random.hpp"
#include "sim/rig/attachment.hpp"
#include "sim/rig/rig_config.hpp"

namespace weft::sim {

struct Rig::Parts {
  Parts(RigConfig read_config, FabricLibrary read_library, std::uint64_t rig_seed)
      : config(std::move(read_config)),
        library(std::move(read_library)),
        seed(rig_seed),
        bench_plant(config.bench_plant, rig_seed) {
    for (const EmulatedDevice& device : config.devices)
      boards.emplace(device.name, FaultBoard(mix(mix(seed, "faults"), device.name)));
    for (const DeviceFault& fault : config.faults) boards.at(fault.device).add(fault.fault);
  }

  /// Pages are served by the box that was switched on last.
  [[nodiscard]] std::unique_ptr<Emulator> box_made(const std::string& name,
                                                   const RdtEmulatorParams& params) {
    auto made = std::make_unique<RdtEmulator>(params, bench_plant, mix(seed, name));
    boxes[name] = made.get();
    return made;
  }

  /// A port of the box uses it to find the box; empty for another device.
  [[nodiscard]] std::function<RdtEmulator*()> box_finder(std::string_view name) {
    if (params_of<RdtEmulatorParams>(name) == nullptr) return {};
    return [this, name = std::string(name)] {
      const auto found = boxes.find(name);
      return found == boxes.end() ? nullptr : found->second;
    };
  }

  /// nullptr for a device of another kind, and an unknown name.
  template <class Params>
  [[nodiscard]] const Params* params_of(std::string_view name) const {
    const EmulatedDevice* device = find_device(config.devices, name);
    return device == nullptr ? nullptr : std::get_if<Params>(&device->params);
  }

  /// Lets the emulator check its faults again.
  void poke(std::string_view device_name) {
    const auto found = attached.find(device_name);
    if (found != attached.end()) found->second->poke();
  }

  [[nodiscard]] std::unique_ptr<Emulator> power_on(const EmulatedDevice& device, TimePoint now) {
    FaultBoard& board = boards.at(device.name);
    auto emulator = make(device, now);
    emulator->attach_faults(board);
    const bool datagrams = (exposure_of(device) & exposed::datagram) != 0;
    return std::make_unique<FaultyWire>(
        std::move(emulator), board,
        datagrams ? FaultyWire::Kind::datagram : FaultyWire::Kind::stream, now);
  }

  [[nodiscard]] std::unique_ptr<Emulator> make(const EmulatedDevice& device, TimePoint now) {
    if (const auto* stage = std::get_if<AptStageParams>(&device.params))
      return std::make_unique<AptStageEmulator>(*stage, bench_plant, now);
    if (const auto* box = std::get_if<RdtEmulatorParams>(&device.params))
      return box_made(device.name, *box);
    if (const auto* digital = std::get_if<AtiDigitalParams>(&device.params))
      return std::make_unique<AtiDigitalEmulator>(*digital, bench_plant, mix(seed, device.name));
    if (const auto* vibro = std::get_if<VibroEmulatorParams>(&device.params)) {
      VibroEmulatorParams with_seed = *vibro;
      with_seed.chunk_seed = mix(seed, device.name);
      return std::make_unique<VibroEmulator>(with_seed, bench_plant, now);
    }
    if (const auto* array = std::get_if<ImprintEmulatorParams>(&device.params)) {
      ImprintEmulatorParams with_seed = *array;
      with_seed.seed = mix(seed, device.name);
      return std::make_unique<ImprintEmulator>(with_seed, bench_plant, now);
    }
    TaxelEmulatorParams taxels = std::get<TaxelEmulatorParams>(device.params);
    taxels.chunk_seed = mix(seed, device.name);
    return std::make_unique<TaxelEmulator>(taxels, bench_plant, now);
  }

  RigConfig config;
  FabricLibrary library;
  std::uint64_t seed;
  BenchPlant bench_plant;
  std::uint32_t patch_number = 0;                         ///< of the mounted piece
  std::map<std::string, FaultBoard, std::less<>> boards;  ///< one per device
  std::map<std::string, RdtEmulator*, std::less<>> boxes;
  std::map<std::string, std::shared_ptr<Attachment>, std::less<>> attached;
  std::map<std::string, std::shared_ptr<Attachment>, std::less<>> pages;
};

Rig::Rig(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Rig::~Rig() = default;

namespace {

/// On a rig with an imprint array every object needs a face; without one the bare plate would be
/// pressed.
Status check_faces(const RigConfig& config, const FabricLibrary& library) {
  const bool presses = std::ranges::any_of(config.devices, [](const EmulatedDevice& device) {
    return std::holds_alternative<ImprintEmulatorParams>(device.params);
  });
  if (!presses) return {};
  for (const std::string& name : library.names())
    if (find_object(name) == nullptr)
      return fail(
          {.code = Errc::not_found,
           .where = name,
           .what = "object without a known face",
           .expected = "an object of sim/plant/imprint/objects.cpp, such as RASP1",
           .got = name,
           .hint = "Use a name from that list, or remove the object from the fabrics of the rig"});
  return {};
}

}  // namespace

Result<std::unique_ptr<Rig>> Rig::create(std::string_view rig_json, std::string_view fabrics_json,
                                         std::uint64_t seed) {
  auto library = parse_fabrics(fabrics_json);
  if (!library) return pass(library.error(), "fabrics");
  auto config =
      parse_rig_config(rig_json, {library->params.cover, library->pads.value_or(PadParams{})});
  if (!config) return pass(config.error(), "rig file");
  library->params.cover = config->bench_plant.plant.cover;
  if (Status ok = check_faces(*config, *library); !ok) return pass(ok.error(), "fabrics");
  auto parts = std::make_unique<Parts>(std::move(*config), std::move(*library), seed);
  return std::unique_ptr<Rig>(new Rig(std::move(parts)));
}

Status Rig::attach(std::string_view device_name, Link& device_end, Loop& loop) {
  const EmulatedDevice* device = find_device(parts_->config.devices, device_name);
  if (device == nullptr)
    return fail({.code = Errc::not_found,
                 .where = std::string(device_name),
                 .what = "device not in the rig file"});
  parts_->bench_plant.advance_to(loop.now());
  const auto attachment =
      std::make_shared<Attachment>(parts_->power_on(*device, loop.now()), device_end, loop);
  parts_->attached[device->name] = attachment;
  attachment->connect();
  return {};
}

std::unique_ptr<ClientEmulator> Rig::page(std::string_view device_name) {
  auto box = parts_->box_finder(device_name);
  if (!box) return nullptr;
  return std::make_unique<NetftPageEmulator>(std::move(box));
}

std::unique_ptr<ClientEmulator> Rig::command_port(std::string_view device_name) {
  auto box = parts_->box_finder(device_name);
  if (!box) return nullptr;
  return std::make_unique<NetftCommandEmulator>(std::move(box));
}

Status Rig::attach_page(std::string_view device_name, Link& device_end, Loop& loop) {
  auto emulator = page(device_name);
  if (emulator == nullptr)
    return fail({.code = Errc::unsupported,
                 .where = std::string(device_name),
                 .what = "device without a settings page"});
  const auto attachment = std::make_shared<Attachment>(std::move(emulator), device_end, loop);
  parts_->pages[std::string(device_name)] = attachment;
  attachment->connect();
  return {};
}

bool Rig::redirects(std::string_view device_name, ByteView datagram) const {
  if (parts_->params_of<RdtEmulatorParams>(device_name) == nullptr)
    return find_device(parts_->config.devices, device_name) != nullptr;
  const auto request = protocols::rdt::decode_request(datagram);
  return request && protocols::rdt::starts_stream(request->command);
}

bool Rig::serves_many(std::string_view device_name) const {
  const auto* digital = parts_->params_of<AtiDigitalParams>(device_name);
  return digital != nullptr && digital->modbus_tcp;
}

void Rig::meet_new_host(std::string_view device_name) {
  const auto found = parts_->attached.find(device_name);
  if (found != parts_->attached.end()) found->second->meet_new_host();
}

void Rig::set_connected(std::string_view device_name, bool connected) {
  const auto found = parts_->attached.find(device_name);
  if (found != parts_->attached.end()) found->second->set_connected(connected);
}

void Rig::keep_up(TimePoint now) {
  for (const auto& [name, attachment] : parts_->attached) {
    if (!attachment->resting()) continue;
    parts_->bench_plant.advance_to(now);
    attachment->catch_up();
  }
}

Status Rig::mount(std::string_view fabric, std::uint64_t seed, TimePoint now) {
  if (Status gone = unmount(now); !gone) return gone;
  return mount(fabric, {seed, seed, seed}, 1, now);
}

Status Rig::mount(std::string_view fabric, const PatchSeeds& seeds, std::uint32_t patch_number,
                  TimePoint now) {
  const Fabric* found = parts_->library.find(fabric);
  if (found == nullptr)
    return fail({.code = Errc::not_found,
                 .what = "fabric unknown",
                 .expected = "a name of the fabric table",
                 .got = std::string(fabric)});
  const auto patch = cut_patch(*found, parts_->library.params, parts_->library.spread,
                               parts_->config.switches, seeds);
  if (!patch) return pass(patch.error());
  if (Status s = check(parts_->config.bench_plant.plant, patch->material); !s)
    return pass(s.error(), fabric);
  const bool same_place = std::exchange(parts_->patch_number, patch_number) == patch_number;
  parts_->bench_plant.mount(*patch, now, same_place);
  return {};
}

Status Rig::unmount(TimePoint now) {
  parts_->bench_plant.mount(bare_plate(parts_->config.bench_plant.plant.cover), now);
  return {};
}

Status Rig::inject(std::string_view order, TimePoint now) {
  const auto object = parse_json(order);
  if (!object) return pass(object.error());
  const auto fault = read_fault(*object, {}, parts_->config.devices, now);
  if (!fault) return pass(fault.error());
  parts_->boards.at(fault->device).add(fault->fault);
  parts_->poke(fault->device);
  return {};
}

Status Rig::clear_faults(std::string_view device_name, std::string_view fault) {
  const auto board = parts_->boards.find(device_name);
  if (board == parts_->boards.end())
    return fail({.code = Errc::not_found,
                 .where = "/device",
                 .what = "device not in the rig file",
                 .got = std::string(device_name)});
  const FaultType* type = find_fault(fault);
  if (!fault.empty() && type == nullptr)
    return fail({.code = Errc::not_found,
                 .where = "/fault",
                 .what = "fault unknown",
                 .got = std::string(fault)});
  if (type != nullptr)
    board->second.clear(type->kind);
  else
    board->second.clear();
  parts_->poke(device_name);
  return {};
}

bool Rig::plugged(std::string_view device_name, TimePoint now) const {
  const auto board = parts_->boards.find(device_name);
  return board == parts_->boards.end() || board->second.active(FaultKind::unplug, now) == nullptr;
}

std::array<double, 5> Rig::stage_positions(TimePoint now) const {
  std::array<double, axis_count> out{};
  for (std::size_t axis = 0; axis < axis_count; ++axis)
    out[axis] = parts_->bench_plant.stage(static_cast<AxisId>(axis)).position(now);
  return out;
}

std::optional<double> Rig::stream_rate_hz(std::string_view device_name) const {
  if (const auto* box = parts_->params_of<RdtEmulatorParams>(device_name)) return box->rate_hz;
  if (const auto* digital = parts_->params_of<AtiDigitalParams>(device_name))
    return digital->rate_hz;
  if (const auto* taxels = parts_->params_of<TaxelEmulatorParams>(device_name))
    return 1e9 / static_cast<double>(taxels->period_ns);
  if (const auto* array = parts_->params_of<ImprintEmulatorParams>(device_name))
    return 1e9 / static_cast<double>(array->period_ns);
  return std::nullopt;
}

std::vector<std::string> Rig::fabrics() const {
  return parts_->library.names();
}

Truth Rig::truth(TimePoint now) {
  const ContactState contact = parts_->bench_plant.contact(now);
  Truth truth{.contact_force_n = contact.normal_n,
              .indentation_m = contact.indentation_m,
              .probe_z_m = contact.probe_z_m(),
              .fabric_point_m = {contact.face_x_m(), contact.face_y_m()},
              .friction_n = contact.friction_n,
              .pad_pressure_pa = parts_->bench_plant.plant().pad_pressures_pa()};
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  const Watched& watched = parts_->config.bench_plant.plant.watched;
  if (!watched.pads) truth.pad_pressure_pa.fill(unknown);
  if (watched.contact) return truth;
  truth.contact_force_n = truth.indentation_m = truth.probe_z_m = unknown;
  truth.friction_n.fill(unknown);
  return truth;
}

void Rig::record_motion(bool on) {
  parts_->bench_plant.record_motion(on);
}

std::optional<BenchMotion> Rig::extract_motion(TimePoint now) {
  parts_->bench_plant.advance_to(now);
  return parts_->bench_plant.extract_motion();
}

RunError Rig::run_error(const BenchMotion& motion, const SampleTimes& sampled,
                        std::optional<double> accuracy_n) const {
  return sim::run_error(parts_->config.bench_plant.plant, parts_->seed, motion, sampled,
                        accuracy_n);
}

const PlantParams& Rig::plant_params() const {
  return parts_->config.bench_plant.plant;
}

std::uint64_t Rig::seed() const {
  return parts_->seed;
}

}  // namespace weft::sim
