#include "daemon/campaign/diagnostics/doctor.hpp"

#include <algorithm>
#include <numeric>
#include <set>

#include "daemon/base/loop/real_loop.hpp"
#include "daemon/campaign/bench_check.hpp"
#include "daemon/campaign/bench_session.hpp"
#include "daemon/hardware/rig/device_lock.hpp"

namespace weft::daemon {
namespace {

void name_devices(const RigFile& rig, const recipes::RigLimits& limits, DoctorReport& report) {
  for (const DeviceEntry& entry : rig.devices) {
    DeviceReport device;
    device.name = entry.name;
    device.role = entry.role;
    device.driver = entry.driver;
    device.link = link_text(entry.link);
    device.configured_rate_hz = limits.stream_rate_hz(entry.role, entry.name);
    if (const auto source = rig.drivers->source(entry.driver)) device.plugin = source->file;
    report.devices.push_back(std::move(device));
  }
}

void examine_simulated(const RigFile& rig, const DoctorRequest& request, DoctorReport& report) {
  const auto refuse = [&](const Error& error) {
    report.found_problems.push_back(problem_of("bench", error));
  };
  const Result<std::string> fabrics = read_fabrics(rig, request.rig);
  if (!fabrics) return refuse(fabrics.error());
  const auto bench = SimulatedBench::create(rig, *fabrics, 1);
  if (!bench) return refuse(bench.error());
  std::vector<BenchExamination::Patient> patients;
  for (std::size_t i = 0; i < report.devices.size(); ++i)
    patients.push_back({(*bench)->bench->devices()[i].get(), &report.devices[i]});
  BenchExamination((*bench)->host_time,
                   [&](const std::function<bool()>& done) { (*bench)->loop.run_until(done); },
                   std::move(patients))
      .run(request.listen_s);
}

/// Checks the port of one device before it is opened; true if it can be opened.
bool can_try_port(const DeviceEntry& entry, DoctorReport& report) {
  const auto* serial = std::get_if<SerialSettings>(&entry.link);
  if (serial == nullptr) return true;
  const auto found_problems = check_serial(entry.name, *serial, report.ports);
  report.found_problems.insert(report.found_problems.end(), found_problems.begin(),
                               found_problems.end());
  return std::ranges::none_of(found_problems,
                              [](const Diagnosis& f) { return f.severity == Severity::problem; });
}

void check_console(RealLoop& loop, const RigFile& rig, DoctorReport& report) {
  if (rig.mode != BenchMode::emulated) return;
  const auto console = open_tcp(loop, rig.console);
  report.found_problems.push_back(
      console ? Diagnosis{Severity::ok,
                          "weft-rig",
                          "accepts requests at " + link_text(TcpPort{rig.console}),
                          {}}
              : problem_of("weft-rig", console.error(), "Start it with `weft-rig RIG`"));
}

bool is_serial(const DeviceEntry& entry) {
  return std::holds_alternative<SerialSettings>(entry.link);
}

/// Serial ports first: opening one cannot take it from another program.
std::vector<std::size_t> make_order(const RigFile& rig) {
  std::vector<std::size_t> out(rig.devices.size());
  std::iota(out.begin(), out.end(), std::size_t{0});
  std::ranges::stable_partition(out, [&](std::size_t i) { return is_serial(rig.devices[i]); });
  return out;
}

/// True if another program uses the rig. A port shared by two devices of this rig does not count.
bool is_in_use(const RigFile& rig, const DoctorReport& report) {
  std::set<std::string> shared;
  for (const Diagnosis& diagnosis : shared_ports(rig.devices)) shared.insert(diagnosis.subject);
  const auto is_refused = [&](const DeviceReport& device) {
    return device.error && device.error->code == Errc::busy && !shared.contains(device.name);
  };
  const auto is_open_elsewhere = [](const DeviceEntry& entry) {
    const auto* serial = std::get_if<SerialSettings>(&entry.link);
    return serial != nullptr && !others_with(*serial).empty();
  };
  return std::ranges::any_of(report.devices, is_refused) ||
         std::ranges::any_of(rig.devices, is_open_elsewhere);
}

/// A network sensor streams to the last host that requested it. A request would take it from a
/// campaign on this rig.
Status require_safe_to_try(const DeviceEntry& entry, const RigFile& rig,
                           const DoctorReport& report) {
  if (is_serial(entry) || !is_in_use(rig, report)) return {};
  return fail({.code = Errc::wrong_state,
               .what = "device not checked, because another program uses this rig",
               .hint = "End that program first"});
}

/// Opens a device as a run does, with its page. Errors: those of a run.
Result<std::unique_ptr<Device>> open_device(RealLoop& loop, const RigFile& rig,
                                            const DeviceEntry& entry) {
  Result<std::unique_ptr<Link>> link = open_link(loop, entry.link);
  if (!link) return pass(link.error());
  Result<std::unique_ptr<Link>> page = open_page(loop, entry);
  if (!page) return pass(page.error());
  return Device::create(entry, loop, std::move(*link), rig.drivers, std::move(*page));
}

void examine_ports(const RigFile& rig, const DoctorRequest& request, DoctorReport& report) {
  RealLoop loop;
  check_console(loop, rig, report);
  DeviceLocks locks;
  std::vector<std::unique_ptr<Device>> devices;
  std::vector<BenchExamination::Patient> patients;
  for (const std::size_t i : make_order(rig)) {
    const DeviceEntry& entry = rig.devices[i];
    Status is_free = locks.acquire(entry, rig.name);
    if (is_free) is_free = require_safe_to_try(entry, rig, report);
    if (!is_free) {
      report.devices[i].error = is_free.error();
      continue;
    }
    if (!can_try_port(entry, report)) continue;
    auto device = open_device(loop, rig, entry);
    if (!device) {
      report.devices[i].error = device.error();
      continue;
    }
    patients.push_back({device->get(), &report.devices[i]});
    devices.push_back(std::move(*device));
  }
  BenchExamination(
      loop, [&](const std::function<bool()>& done) { loop.run_until(done); }, std::move(patients))
      .run(request.listen_s);
}

void add(std::vector<Diagnosis>& to, const std::vector<Diagnosis>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

std::vector<Diagnosis> unclaimed_controllers() {
  std::vector<Diagnosis> out;
  for (const std::string& serial : thorlabs_without_port("/sys/bus/usb/devices"))
    out.push_back({Severity::warning, "usb",
                   "Thorlabs controller (" + serial + ") connected, but without serial port",
                   "Run `sudo modprobe ftdi_sio && echo 0403 faf0 | sudo tee "
                   "/sys/bus/usb-serial/drivers/ftdi_sio/new_id`"});
  return out;
}

}  // namespace

std::size_t DoctorReport::count(Severity severity) const {
  return static_cast<std::size_t>(
      std::ranges::count(found_problems, severity, &Diagnosis::severity));
}

Result<DoctorReport> examine(const DoctorRequest& request) {
  const auto opened = open_rig(request.rig, request.plugins);
  if (!opened) return pass(opened.error());
  const auto& [rig, limits] = *opened;
  DoctorReport report;
  report.rig_name = rig.name;
  report.mode = rig.mode;
  report.ports = serial_ports();
  name_devices(rig, limits, report);
  const bool real_time = rig.mode != BenchMode::simulated;
  if (real_time) {
    add(report.found_problems, shared_ports(rig.devices));
    examine_ports(rig, request, report);
    add(report.found_problems, unclaimed_controllers());
  } else {
    examine_simulated(rig, request, report);
  }
  add(report.found_problems, check_devices(report.devices));
  add(report.found_problems, check_system(check_machine(request.data_folder), real_time));
  return report;
}

}  // namespace weft::daemon
