#pragma once
// Examines a rig from the rig file to the samples: what is there, what is wrong, what to do.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/campaign/diagnostics/bench_examination.hpp"
#include "daemon/hardware/link/port_link.hpp"
#include "daemon/hardware/rig/rig_file.hpp"

namespace weft::daemon {

// Requirements of a bench on the computer: punctuality, clocks, room for the data.

/// Measured facts, so that the judgement can be tested apart from the computer.
struct MachineFacts {
  bool fifo_permitted = false;               ///< SCHED_FIFO
  bool memory_lockable = false;              ///< without a limit
  long clock_resolution_ns = 0;              ///< of CLOCK_MONOTONIC
  std::optional<bool> clock_synchronised;    ///< of the wall clock, by NTP or PTP; nullopt: unknown
  std::vector<std::string> governors;        ///< of each processor; empty: no frequency scaling
  std::optional<std::uintmax_t> free_bytes;  ///< where the data go; nullopt: no such folder
  bool folder_writable = false;
  std::string software;  ///< software_version()
};

/// Tries real-time priority and memory locks for a moment, and checks the folder of the data.
MachineFacts check_machine(const std::filesystem::path& data_folder);

/// Findings in the order of MachineFacts. In virtual time punctuality does not matter.
std::vector<Diagnosis> check_system(const MachineFacts& facts, bool real_time);

// Ports of the operating system: a list, their holders, and why one cannot be opened.

/// A serial port of the computer, as libserialport lists it.
struct SerialPortSeen {
  std::string name;  ///< "/dev/ttyUSB0"
  std::string description;
  int usb_vendor = -1;  ///< -1: not on USB
  int usb_product = -1;
  std::string usb_serial;
  std::string note;  ///< its probable kind
};
std::vector<SerialPortSeen> serial_ports();

/// "Thorlabs controller" for 0403:FAF0; empty for an unknown pair.
std::string usb_note(int vendor, int product);

/// Thorlabs controllers below `usb_devices` (/sys/bus/usb/devices) without a serial driver.
std::vector<std::string> thorlabs_without_port(const std::filesystem::path& usb_devices);

/// Problems of a serial port before it is opened: missing, no permission, held by another program,
/// an FTDI chip with a long latency. Empty if nothing is wrong.
std::vector<Diagnosis> check_serial(const std::string& device, const SerialSettings& settings,
                                    const std::vector<SerialPortSeen>& present);

/// "minicom (pid 17)" for every other program that has the port open, as far as it can be seen.
/// Empty for a pseudo-terminal: weft-rig holds both ends.
std::vector<std::string> others_with(const SerialSettings& settings);
/// Whether others_with() sees each program below `processes` (/proc). Only root sees the open files
/// of other users' programs.
bool can_see_holders(const std::filesystem::path& processes);

/// Devices of a rig that claim one port, each pair once.
std::vector<Diagnosis> shared_ports(const std::vector<DeviceEntry>& devices);

/// "serial /dev/ttyUSB0 at 115200 baud", "tcp HOST:PORT", "memory".
std::string link_text(const LinkSettings& link);

struct DoctorRequest {
  std::filesystem::path rig;
  std::filesystem::path data_folder = ".";  ///< where campaigns are recorded
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

/// Opens and arms every device; enables stages, but moves nothing. Takes `listen_s` plus the time
/// of slow devices. Errors: a rig file that cannot be read. Problems of the bench are findings.
Result<DoctorReport> examine(const DoctorRequest& request);

/// An error as a finding. `hint` replaces the error's own, unless empty.
Diagnosis problem_of(const std::string& subject, Error error, const std::string& hint = {});

/// Findings from the reports of the devices.
std::vector<Diagnosis> check_devices(const std::vector<DeviceReport>& devices);

}  // namespace weft::daemon
