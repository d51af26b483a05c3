#pragma once
// What the doctor says: one thing that was looked at.

#include <cstdint>
#include <string>
#include <string_view>

namespace weft::daemon {

enum class Severity : std::uint8_t {
  ok,
  warning,  ///< a campaign may run, worse than it could
  problem   ///< a campaign cannot run, or its data would not be trusted
};
constexpr std::string_view to_string(Severity severity) {
  switch (severity) {
    case Severity::ok:
      return "ok";
    case Severity::warning:
      return "warning";
    case Severity::problem:
      return "problem";
  }
  return "unknown";
}

struct Diagnosis {
  Severity severity = Severity::ok;
  std::string subject;  ///< "stage.x", "clock"
  std::string what;
  std::string hint;  ///< what to do about it; empty when all is well
};

}  // namespace weft::daemon
