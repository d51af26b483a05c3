#include "sim/rig/rig_config.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "sim/plant/field_reader.hpp"

namespace weft::sim {

namespace {

constexpr double longest_s = 1e6;
constexpr double for_ever_s = -1;

std::string names_for(std::uint8_t exposure) {
  std::string names;
  for (const FaultType& type : fault_types())
    if ((type.whom & exposure) != 0) names += (names.empty() ? "" : ", ") + std::string(type.name);
  return names;
}

struct Fields {
  std::string device, kind, towards = "host";
  double start_s = 0, duration_s = for_ever_s, probability = 1;
};

Result<const FaultType*> kind_for(const Fields& fields, const std::string& where,
                                  const std::vector<EmulatedDevice>& devices) {
  const EmulatedDevice* device = find_device(devices, fields.device);
  if (device == nullptr)
    return fail({.code = Errc::not_found,
                 .where = where + "/device",
                 .what = "device not in the rig file",
                 .got = fields.device});
  const std::uint8_t exposure = exposure_of(*device);
  const FaultType* type = find_fault(fields.kind);
  if (type == nullptr)
    return fail({.code = Errc::not_found,
                 .where = where + "/fault",
                 .what = "fault unknown",
                 .expected = names_for(exposure),
                 .got = fields.kind});
  if ((type->whom & exposure) == 0)
    return fail({.code = Errc::unsupported,
                 .where = where + "/fault",
                 .what = "fault not available for " + fields.device,
                 .expected = names_for(exposure),
                 .got = fields.kind});
  return type;
}

}  // namespace

const EmulatedDevice* find_device(const std::vector<EmulatedDevice>& devices,
                                  std::string_view name) {
  const auto found = std::ranges::find(devices, name, &EmulatedDevice::name);
  return found == devices.end() ? nullptr : &*found;
}

std::uint8_t exposure_of(const EmulatedDevice& device) {
  if (std::holds_alternative<AptStageParams>(device.params))
    return exposed::stage | exposed::stream;
  if (std::holds_alternative<AtiDigitalParams>(device.params))
    return exposed::digital | exposed::stream;
  if (std::holds_alternative<RdtEmulatorParams>(device.params))
    return exposed::force | exposed::datagram;
  if (const auto* vibro = std::get_if<VibroEmulatorParams>(&device.params))
    return exposed::vibration | (vibro->datagrams ? exposed::datagram : exposed::stream);
  if (std::holds_alternative<ImprintEmulatorParams>(device.params))
    return exposed::imprint | exposed::stream;
  const auto& taxels = std::get<TaxelEmulatorParams>(device.params);
  return exposed::taxels | (taxels.wire == TaxelWire::weft ? exposed::stream : exposed::datagram);
}

Result<DeviceFault> read_fault(const nlohmann::json& object, const std::string& where,
                               const std::vector<EmulatedDevice>& devices, TimePoint origin) {
  if (!object.is_object())
    return parse_error(where, {.what = "value has the wrong type", .expected = "an object"});
  Fields fields;
  FieldReader reader(object, where);
  reader.text("device", fields.device).text("fault", fields.kind).text("towards", fields.towards);
  reader.number("start_s", fields.start_s, 0, longest_s);
  reader.number("duration_s", fields.duration_s, 0, longest_s);
  reader.number("probability", fields.probability, 0, 1);
  const auto type = kind_for(fields, where, devices);
  if (!type) return pass(type.error());
  Fault fault{.kind = (*type)->kind, .amount = (*type)->amount};
  reader.number("amount", fault.amount, -1e9, 1e9);
  if (Status s = reader.finish(); !s) return pass(s.error());
  if (fields.towards != "host" && fields.towards != "device")
    return parse_error(
        where + "/towards",
        {.what = "direction invalid", .expected = "host or device", .got = fields.towards});
  fault.to_device = fields.towards == "device";
  if (fault.to_device && ((*type)->whom & exposed::wire) == 0)
    return parse_error(where + "/towards", {.what = "direction not allowed for this fault",
                                            .expected = "a fault of the wire",
                                            .got = fields.kind});
  fault.probability = fields.probability;
  fault.from = origin + from_seconds(fields.start_s);
  if (fields.duration_s != for_ever_s) fault.until = fault.from + from_seconds(fields.duration_s);
  return DeviceFault{fields.device, fault};
}

}  // namespace weft::sim
