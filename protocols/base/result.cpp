#include "protocols/base/result.hpp"

#include <array>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

namespace weft {
namespace {

// docs/reference/errors.md is generated from these rows.
constexpr std::array<ErrorCode, 23> codes{{
    {Errc::invalid_argument, "invalid argument", "request.invalid", 1000, false,
     "An option, a key or a parameter cannot be used.", "Correct what the message names."},
    {Errc::parse, "parse", "request.unreadable", 1001, false,
     "Bytes or text do not follow their format.",
     "Correct the file at the named place, or create it again."},
    {Errc::checksum, "checksum", "storage.checksum", 6003, false,
     "A frame or a block disagrees with its check value.",
     "Check the cable; for a file, use an unaltered copy."},
    {Errc::range, "range", "param.range", 1012, false, "A value is outside its limits.",
     "Choose a value inside the limits that the message names."},
    {Errc::not_found, "not found", "not_found", 1004, false,
     "A file, a run, a device or a name does not exist.",
     "Check the name in the list of existing ones."},
    {Errc::io, "io", "storage.io", 6000, true, "The operating system refused to read or to write.",
     "Check permissions, cable and disk, then repeat."},
    {Errc::timeout, "timeout", "device.timeout", 4008, true,
     "Nothing was received, or a step did not end, in time.",
     "Check power and cable of the named device, then repeat."},
    {Errc::wrong_state, "wrong state", "state.conflict", 3000, true,
     "The device, run or queue is in a state that does not allow this.",
     "Wait for another state or change it, then repeat."},
    {Errc::device, "device", "device.fault", 4000, false, "A device reports a fault of its own.",
     "Find the fault in the manual of the device, and clear it at the device."},
    {Errc::safety, "safety", "safety.guard", 5000, false, "A guard stopped the motion.",
     "Inspect the bench, remove the cause, then reset."},
    {Errc::unsupported, "unsupported", "unsupported", 1011, false,
     "This version, build or device cannot do this.",
     "Use another version, or install the named part."},
    {Errc::corrupt, "corrupt", "storage.corrupt", 6012, false,
     "Stored data were truncated or altered.",
     "Use an unaltered copy; `weft verify` names the part."},
    {Errc::device_settings, "device settings", "device.settings", 4001, false,
     "A device is set up differently from the rig file.",
     "Change the rig file or the settings of the device, so that both agree."},
    {Errc::device_identity, "device identity", "device.identity", 4002, false,
     "The connected unit differs from the rig file.",
     "Connect the named unit, or correct the rig file."},
    {Errc::device_data, "device data", "device.data", 4003, false,
     "A device sends values that cannot be measurements: frozen, jumping, damaged.",
     "Check sensor and cable; restart the device."},
    {Errc::device_motion, "device motion", "device.motion", 4004, false,
     "A stage did not perform the commanded motion.",
     "Check for an obstacle, a disabled channel and the motor cable; home again."},
    {Errc::device_refused, "device refused", "device.refused", 4005, false,
     "A device refused a command or did not store a setting.",
     "Check its firmware and whether another program controls it."},
    {Errc::device_restarted, "device restarted", "device.restarted", 4006, true,
     "A device restarted or changed while it was in use.", "Check its power supply, then repeat."},
    {Errc::driver, "driver", "driver.fault", 4007, false,
     "The code of a driver failed: it threw an exception or did not return.",
     "Report it to the author of the driver, and run without the driver."},
    {Errc::measurement, "measurement", "measurement.rejected", 3001, false,
     "A measurement does not meet its quality limits.",
     "Check fabric, probe and plate, then measure again."},
    {Errc::trials_failed, "trials failed", "campaign.trials_failed", 3002, false,
     "Trials of the campaign failed, so its data set lacks them.",
     "See the reasons in `weft log`, then resume the campaign."},
    {Errc::no_space, "no space", "storage.full", 6001, true, "The disk has too little free space.",
     "Free space, or choose another folder, then repeat."},
    {Errc::busy, "busy", "resource.busy", 3003, true,
     "Another program uses the folder, the file or the port.",
     "End the other program, or wait for it, then repeat."},
}};

}  // namespace

std::span<const ErrorCode> error_codes() {
  return codes;
}

std::string_view to_string(Errc code) {
  const auto at = static_cast<std::size_t>(code) - 1;
  return at < codes.size() ? codes.at(at).name : "unknown";
}

Error&& Error::in(std::string_view context) && {
  const std::string outer(context);
  if (where.empty())
    where = outer;
  else if (where != outer && !where.starts_with(outer + ": "))  // else the context is there already
    where = outer + ": " + where;
  return std::move(*this);
}

namespace {

// A message may already end a sentence.
std::string as_sentence(std::string text) {
  if (text.empty() || (text.back() != '?' && text.back() != '.')) text += '.';
  return text;
}

}  // namespace

std::string to_string(const Error& error) {
  std::string text = error.where.empty() ? error.what : error.where + ": " + error.what;
  if (!error.got.empty()) text += ": " + error.got;
  if (!error.expected.empty()) text += " (expected " + error.expected + ")";
  text = as_sentence(std::move(text));
  return error.hint.empty() ? text : text + " " + as_sentence(error.hint);
}

void assertion_failed(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "weft: broken contract: %s at %s:%d\n", condition, file, line);
  std::abort();
}

}  // namespace weft
