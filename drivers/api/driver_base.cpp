#include "drivers/api/driver_base.hpp"

#include <string>

namespace weft {

Status DriverBase::require(DriverState wanted, std::string_view action) const {
  if (state_ == wanted) return {};
  return fail(Errc::wrong_state,
              std::string(action) + " is refused: the driver is " + std::string(to_string(state_)),
              {}, std::string(to_string(wanted)), std::string(to_string(state_)),
              state_ == DriverState::faulted ? "Close the driver and open it again" : "");
}

Status DriverBase::attach() {
  if (attached_) return fail(Errc::wrong_state, "open is refused: opening is under way");
  attached_ = true;
  host_->link().on_receive([this](ByteView bytes, TimePoint arrival) { received(bytes, arrival); });
  host_->link().on_closed([this](const Error& why) {
    raise(Error{why.code, "the link to the device closed: " + why.message, why.where, why.expected,
                why.got, "Check the cable and the power of the device"});
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

void DriverBase::raise(const Error& error) {
  if (state_ == DriverState::faulted || !attached_) return;
  make_safe();
  detach();
  enter(LifecycleEvent::fault);
  host_->fault(error);
}

}  // namespace weft
