#include "sim/rig/digital_config.hpp"

#include <nlohmann/json.hpp>

#include "protocols/base/units.hpp"
#include "sim/plant/field_reader.hpp"

namespace weft::sim {

Result<AtiDigitalParams> read_digital(const nlohmann::json& emulator, const std::string& where) {
  AtiDigitalParams params;
  FtSensorParams& sensor = params.sensor;
  std::string kind, framing = "rtu";
  double slave = params.slave, calibration = params.calibration, status = 0, noise = 1;
  FieldReader reader(emulator, where);
  reader.text("kind", kind).text("framing", framing).text("serial", params.serial);
  reader.number("rate_hz", params.rate_hz, 1, 7000).number("slave", slave, 1, 247);
  reader.number("calibration", calibration, 1, protocols::ati_digital::calibrations);
  reader.number("status_word", status, 0, 0x3FFF);
  reader.number("counts_per_n", sensor.counts_per_n, 1000, 1e7);
  reader.number("counts_per_nm", sensor.counts_per_nm, 1000, 1e7);
  reader.number("plate_mass_kg", sensor.plate_mass_kg, 0, 5);
  reader.number("height_mm", sensor.height_m, 0, 500, m_per_mm);
  reader.number("noise_scale", noise, 0, 1000);
  if (Status s = reader.finish(); !s) return pass(s.error());
  if (framing != "rtu" && framing != "tcp")
    return fail({.code = Errc::parse,
                 .where = where + "/framing",
                 .what = "no such framing",
                 .expected = "rtu or tcp",
                 .got = framing});
  params.modbus_tcp = framing == "tcp";
  params.slave = static_cast<std::uint8_t>(slave);
  params.calibration = static_cast<int>(calibration);
  params.status_word = static_cast<std::uint16_t>(status);
  for (double& component : sensor.noise) component *= noise;
  return params;
}

}  // namespace weft::sim
