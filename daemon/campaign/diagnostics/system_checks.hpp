#pragma once
// What the machine itself must give a bench: punctuality, clocks, room for the data.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/campaign/diagnostics/diagnosis.hpp"

namespace weft::daemon {

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

}  // namespace weft::daemon
