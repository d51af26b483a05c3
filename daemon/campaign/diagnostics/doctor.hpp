#pragma once
// A rig looked over from the rig file to the samples: what is there, what is wrong, what to do.

#include <filesystem>

#include "daemon/campaign/diagnostics/bench_examination.hpp"
#include "daemon/campaign/diagnostics/port_checks.hpp"
#include "daemon/hardware/rig/rig_file.hpp"

namespace weft::daemon {

struct DoctorRequest {
  std::filesystem::path rig;
  std::filesystem::path data_folder = ".";  ///< where campaigns will be recorded
  double listen_s = 2;
  PluginSettings plugins = {};
};

struct DoctorReport {
  std::string rig_name;
  BenchMode mode = BenchMode::simulated;
  std::vector<DeviceReport> devices;
  std::vector<Diagnosis> found_problems;
  std::vector<SerialPortSeen> ports;

  [[nodiscard]] std::size_t count(Severity severity) const;
};

/// Opens and arms every device, enables stages and moves nothing; takes `listen_s` and what slow
/// devices take. Errors: a rig file that cannot be read. What is wrong with the bench is a finding.
Result<DoctorReport> examine(const DoctorRequest& request);

/// An error as a finding; its own hint unless another one is given.
Diagnosis problem_of(const std::string& subject, Error error, const std::string& hint = {});

/// What the reports of the devices mean.
std::vector<Diagnosis> check_devices(const std::vector<DeviceReport>& devices);

}  // namespace weft::daemon
