#include "drivers/api/driver_base.hpp"

#include <nlohmann/json.hpp>
#include <string>

#include "protocols/base/printable.hpp"

namespace weft {

// Text from a device may be invalid UTF-8: invalid bytes become U+FFFD.
std::string to_json(const DeviceIdentity& identity) {
  nlohmann::json reported = nlohmann::json::object();
  nlohmann::json scale = nlohmann::json::object();
  for (const auto& [key, text] : identity.reported) reported[key] = text;
  for (const auto& [key, value] : identity.scale) scale[key] = value;
  return nlohmann::json{{"reported", reported}, {"scale", scale}}.dump(
      -1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Status DriverBase::require(DriverState wanted, std::string_view action) const {
  if (state_ == wanted) return {};
  return fail({.code = Errc::wrong_state,
               .what = std::string(action) + " refused in this state of the driver",
               .expected = std::string(to_string(wanted)),
               .got = std::string(to_string(state_)),
               .hint = state_ == DriverState::faulted ? "Close the driver and open it again" : ""});
}

Status DriverBase::attach() {
  if (Status allowed = require(DriverState::closed, "open"); !allowed) return allowed;
  if (attached_)
    return fail({.code = Errc::wrong_state, .what = "open refused: the driver is already opening"});
  attached_ = true;
  host_->link().on_receive(
      [this](ByteView bytes, TimePoint arrival) { guard([&] { received(bytes, arrival); }); });
  host_->link().on_closed([this](const Error& why) {
    raise(Error{.code = why.code,
                .where = why.where,
                .what = "link to the device closed: " + why.what,
                .expected = why.expected,
                .got = why.got,
                .hint = "Check the cable and the power of the device"});
  });
  return {};
}

void DriverBase::detach() {
  if (!attached_) return;
  attached_ = false;
  host_->link().on_receive({});
  host_->link().on_closed({});
}

bool DriverBase::send(ByteView bytes) {
  Status written = host_->link().write(bytes);
  if (!written) raise(written.error());
  return written.has_value();
}

void DriverBase::send_last(ByteView bytes) {
  const Status written = host_->link().write(bytes);
  if (!written) host_->log(LogLevel::warning, to_string(written.error()));
}

void DriverBase::enter(LifecycleEvent event) {
  const std::optional<DriverState> to = next(state_, event);
  if (!to || *to == state_) return;
  state_ = *to;
  host_->state_changed(state_);
}

void DriverBase::raise_exception(const char* why) {
  raise({.code = Errc::driver,
         .what = "exception in the driver while receiving",
         .got = printable(why, 80),
         .hint = "Check that the device fits the driver; report the exception to the author of the "
                 "driver"});
}

void DriverBase::raise(const Error& error) {
  if (state_ == DriverState::faulted || !attached_) return;
  make_safe();
  detach();
  enter(LifecycleEvent::fault);
  host_->fault(error);
}

}  // namespace weft
