#pragma once
// A rig looked over from the rig file to the samples: what is there, what is wrong, what to do.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/campaign/diagnostics/bench_examination.hpp"
#include "daemon/hardware/link/port_link.hpp"
#include "daemon/hardware/rig/rig_file.hpp"

namespace weft::daemon {

// What the machine itself must give a bench: punctuality, clocks, room for the data.

/// What was found out of the machine, so that the judgement can be tested apart from it.
struct MachineFacts {
  bool fifo_permitted = false;             ///< SCHED_FIFO
  bool memory_lockable = false;            ///< without a limit
  long clock_resolution_ns = 0;            ///< of CLOCK_MONOTONIC
  std::optional<bool> clock_synchronised;  ///< of the wall clock, by NTP or PTP; nullopt: not told
  std::vector<std::string> governors;      ///< of each processor; empty: no frequency scaling
  std::optional<std::uintmax_t> free_bytes;  ///< where the data go; nullopt: no such folder
  bool folder_writable = false;
  std::string software;  ///< software_version()
};

/// Tries real-time priority and memory locks for a moment, and looks at the folder of the data.
MachineFacts check_machine(const std::filesystem::path& data_folder);

/// Findings in the order of MachineFacts. In virtual time punctuality does not matter.
std::vector<Diagnosis> check_system(const MachineFacts& facts, bool real_time);

// Ports of the operating system: which there are, whose they are, and why one cannot be opened.

/// A serial port that the machine has, as libserialport lists it.
struct SerialPortSeen {
  std::string name;  ///< "/dev/ttyUSB0"
  std::string description;
  int usb_vendor = -1;  ///< -1: not on USB
  int usb_product = -1;
  std::string usb_serial;
  std::string note;  ///< what it probably is
};
std::vector<SerialPortSeen> serial_ports();

/// "Thorlabs controller" for 0403:FAF0; empty when the pair says nothing.
std::string usb_note(int vendor, int product);

/// Thorlabs controllers below `usb_devices` (/sys/bus/usb/devices) that no serial driver took.
std::vector<std::string> thorlabs_without_port(const std::filesystem::path& usb_devices);

/// What can be said of a serial port before it is opened: missing, no permission, held by another
/// program, an FTDI chip that waits too long. Empty when nothing is wrong.
std::vector<Diagnosis> check_serial(const std::string& device, const SerialSettings& settings,
                                    const std::vector<SerialPortSeen>& present);

/// "minicom (pid 17)" for every other program that has the port open, as far as it may be seen.
/// None of a pseudo-terminal, of which weft-rig holds both ends.
std::vector<std::string> others_with(const SerialSettings& settings);
/// Whether others_with() would see each program below `processes` (/proc): who is not root does not
/// see what other users' programs have open.
bool can_see_holders(const std::filesystem::path& processes);

/// Devices of a rig that claim one port, each pair once.
std::vector<Diagnosis> shared_ports(const std::vector<DeviceEntry>& devices);

/// "serial /dev/ttyUSB0 at 115200 baud", "tcp HOST:PORT", "memory".
std::string link_text(const LinkSettings& link);

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
