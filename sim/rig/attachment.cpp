#include "sim/rig/attachment.hpp"

#include <algorithm>
#include <utility>

namespace weft::sim {

Attachment::Attachment(std::unique_ptr<Emulator> emulator, Link& link, Loop& loop)
    : emulator_(std::move(emulator)), link_(&link), loop_(&loop) {
  // A device sends even without a host, so a failed write is ignored.
  sink_ = [this](ByteView bytes) { static_cast<void>(link_->write(bytes)); };
}

void Attachment::connect() {
  link_->on_receive([weak = weak_from_this()](ByteView bytes, TimePoint) {
    if (const auto self = weak.lock()) self->receive(bytes);
  });
  schedule();
}

void Attachment::receive(ByteView bytes) {
  catch_up();
  connected_ = true;
  emulator_->receive(bytes, loop_->now(), sink_);
  schedule();
}

void Attachment::meet_new_host() {
  emulator_->meet_new_host();
  schedule();
}

void Attachment::set_connected(bool connected) {
  if (connected == connected_) return;
  catch_up();
  connected_ = connected;
  schedule();
}

void Attachment::catch_up() {
  if (resting_) emulator_->skip_to(loop_->now());
}

void Attachment::wake() {
  catch_up();
  if (scheduled_) loop_->cancel(timer_);
  scheduled_.reset();
  emulator_->wake(loop_->now(), sink_);
  schedule();
}

void Attachment::schedule() {
  resting_ = !connected_ && emulator_->can_rest();
  const std::optional<TimePoint> due =
      resting_ ? std::optional<TimePoint>() : emulator_->next_wakeup();
  if (due == scheduled_) return;
  if (scheduled_) loop_->cancel(timer_);
  scheduled_ = due;
  if (!due) return;
  timer_ = loop_->at(std::max(*due, loop_->now()), [weak = weak_from_this()] {
    const auto self = weak.lock();
    if (!self) return;
    self->scheduled_.reset();
    self->wake();
  });
}

}  // namespace weft::sim
