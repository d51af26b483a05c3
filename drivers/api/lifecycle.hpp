#pragma once
// The driver lifecycle: one table, one pure function. A pair that is not in the table is refused.

#include <array>
#include <optional>
#include <string_view>

#include "drivers/api/driver.hpp"

namespace weft {

enum class LifecycleEvent { opened, armed, disarmed, fault, close };

struct LifecycleRow {
  DriverState from;
  LifecycleEvent event;
  DriverState to;
};

inline constexpr std::array lifecycle_table{
    LifecycleRow{DriverState::closed, LifecycleEvent::opened, DriverState::open},
    LifecycleRow{DriverState::open, LifecycleEvent::armed, DriverState::armed},
    LifecycleRow{DriverState::armed, LifecycleEvent::disarmed, DriverState::open},
    LifecycleRow{DriverState::closed, LifecycleEvent::fault, DriverState::faulted},
    LifecycleRow{DriverState::open, LifecycleEvent::fault, DriverState::faulted},
    LifecycleRow{DriverState::armed, LifecycleEvent::fault, DriverState::faulted},
    LifecycleRow{DriverState::closed, LifecycleEvent::close, DriverState::closed},
    LifecycleRow{DriverState::open, LifecycleEvent::close, DriverState::closed},
    LifecycleRow{DriverState::armed, LifecycleEvent::close, DriverState::closed},
    LifecycleRow{DriverState::faulted, LifecycleEvent::close, DriverState::closed},
};

constexpr std::optional<DriverState> next(DriverState state, LifecycleEvent event) {
  for (const LifecycleRow& row : lifecycle_table)
    if (row.from == state && row.event == event) return row.to;
  return std::nullopt;
}

constexpr std::string_view to_string(DriverState state) {
  switch (state) {
    case DriverState::closed:
      return "closed";
    case DriverState::open:
      return "open";
    case DriverState::armed:
      return "armed";
    case DriverState::faulted:
      return "faulted";
  }
  return "unknown";
}

}  // namespace weft
