#include "drivers/ati_netft/netft_driver.hpp"

#include <cmath>
#include <string>

namespace weft::drivers {

using namespace protocols::rdt;

namespace {
/// Datagrams may be lost: the one-sample request that opens is sent so often at most.
constexpr int max_opening_tries = 3;
}  // namespace

NetftDriver::NetftDriver(const NetftSettings& settings, DriverHost& driver_host)
    : DriverBase(driver_host),
      settings_(settings),
      opening_(driver_host.loop(), [this] { on_opening_timeout(); }),
      stale_(driver_host.loop(), [this] { on_stale(); }) {}

Status NetftDriver::open() noexcept {
  if (Status allowed = require(DriverState::closed, "open"); !allowed) return allowed;
  if (Status taken = attach(); !taken) return taken;
  bad_datagrams_ = late_records_ = 0;
  opening_tries_ = 1;
  opening_.start(settings_.reply_timeout);
  if (!request(RequestCommand::start_realtime, 1))
    return fail(Errc::io, "the link refused the opening request");
  return {};
}

Status NetftDriver::arm() noexcept {
  if (Status allowed = require(DriverState::open, "arm"); !allowed) return allowed;
  if (streaming_) return fail(Errc::wrong_state, "arm is refused: arming is under way");
  sequence_.reset();
  streaming_ = true;
  stale_.expect_within(std::max(settings_.stale_after, settings_.reply_timeout));
  if (!request(RequestCommand::start_realtime, 0))
    return fail(Errc::io, "the link refused the start request");
  return {};
}

Result<std::uint32_t> NetftDriver::command(const Command& command) noexcept {
  if (Status allowed = require(DriverState::armed, "the command"); !allowed)
    return pass(std::move(allowed.error()));
  if (!std::holds_alternative<BiasCommand>(command))
    return fail(Errc::unsupported, "a force/torque sensor does not move: it takes a bias only");
  if (!request(RequestCommand::set_bias, 0))
    return fail(Errc::io, "the link refused the bias request");
  return 0;
}

void NetftDriver::stop() noexcept {
  if (!attached()) return;
  end_stream();
  enter(LifecycleEvent::disarmed);
}

void NetftDriver::close() noexcept {
  if (attached()) {
    end_stream();
    detach();
  }
  enter(LifecycleEvent::close);
}

void NetftDriver::make_safe() noexcept {
  end_stream();
}

// A stop is harmless to a box that sends nothing, and needed by one that a dead host left sending.
void NetftDriver::end_stream() {
  streaming_ = false;
  opening_.cancel();
  stale_.stop();
  send_last(encode(Request{RequestCommand::stop, 0}));
}

bool NetftDriver::request(RequestCommand command, std::uint32_t sample_count) {
  return send(encode(Request{command, sample_count}));
}

void NetftDriver::received(ByteView datagram, TimePoint arrival) {
  const Result<std::size_t> count = record_count(datagram);
  if (!count) return on_bad_datagram(count.error());
  for (std::size_t i = 0; attached() && i < *count; ++i) {
    const Result<Record> record = decode_record(datagram.subspan(i * record_size, record_size));
    if (record) on_record(*record, arrival);
  }
}

void NetftDriver::on_bad_datagram(const Error& error) {
  if (++bad_datagrams_ == 1) host().log(LogLevel::warning, to_string(error));
}

void NetftDriver::on_record(const Record& record, TimePoint arrival) {
  if (state() == DriverState::closed) {
    opening_.cancel();
    // RDT records carry no serial number and no calibration: nothing is reported.
    host().identified({.reported = {},
                       .scale = {{"counts_per_n", 1 / settings_.newton_per_count},
                                 {"counts_per_nm", 1 / settings_.newton_metre_per_count},
                                 {"sign_z", settings_.sign_z}}});
    enter(LifecycleEvent::opened);
    return;
  }
  if (!streaming_) return;
  stale_.expect_within(settings_.stale_after);
  const SequenceStep step = sequence_.observe(record.rdt_sequence);
  if (step.event == SequenceEvent::duplicate || step.event == SequenceEvent::out_of_order) {
    if (++late_records_ == 1)
      host().log(LogLevel::warning, "a record came twice or out of order and was dropped");
    return;
  }
  if (state() == DriverState::open) enter(LifecycleEvent::armed);
  if (state() == DriverState::armed) host().publish(to_sample(record, step.lost, arrival));
}

Sample NetftDriver::to_sample(const Record& record, std::uint32_t lost, TimePoint arrival) {
  WrenchSample wrench;
  for (std::size_t i = 0; i < 3; ++i) {
    wrench.force_n[i] = record.force_counts[i] * settings_.newton_per_count;
    wrench.torque_nm[i] = record.torque_counts[i] * settings_.newton_metre_per_count;
  }
  wrench.force_n[2] *= settings_.sign_z;
  wrench.status = record.status;
  wrench.valid = values_valid(record.status) && within_rating(wrench);
  return {arrival, record.rdt_sequence, lost, wrench};
}

/// Beyond its rating the calibration does not hold, and the sensor is in danger.
bool NetftDriver::within_rating(const WrenchSample& wrench) {
  bool within = true;
  for (std::size_t i = 0; i < 3; ++i)
    within = within && std::abs(wrench.force_n[i]) <= settings_.rated_force_n[i];
  if (!within && !overrange_)
    host().log(LogLevel::warning, "a force is beyond the sensor's rating");
  overrange_ = !within;
  return within;
}

void NetftDriver::on_opening_timeout() {
  if (opening_tries_ < max_opening_tries) {
    ++opening_tries_;
    if (request(RequestCommand::start_realtime, 1)) opening_.start(settings_.reply_timeout);
    return;
  }
  raise({Errc::timeout,
         "the Net F/T box does not answer",
         {},
         "a record within " + std::to_string(to_seconds(settings_.reply_timeout)) + " s",
         "silence after " + std::to_string(max_opening_tries) + " requests",
         "Check the address in the rig file, the cable and the box's RDT setting"});
}

void NetftDriver::on_stale() {
  raise({Errc::timeout,
         "no record came from the force/torque sensor",
         {},
         "one every " + std::to_string(to_seconds(settings_.stale_after)) + " s at least",
         "silence",
         "Another client's start request redirects the stream: look for one"});
}

}  // namespace weft::drivers
