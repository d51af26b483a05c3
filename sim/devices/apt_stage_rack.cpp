// What an APT controller is plugged into: bays, hub, digital outputs, analogue input.

#include "sim/devices/apt_stage_emulator.hpp"

namespace weft::sim {

using namespace protocols::apt;

namespace {

constexpr std::uint8_t occupied = 1, vacant = 2;
constexpr std::uint8_t off_the_hub = 0xFF;  // -1 (issue of December 2025, HUB_GET_BAYUSED)

}  // namespace

bool AptStageEmulator::handle_rack(const Message& message, ByteSink& out) {
  const bool to_rack = params_.bay && message.dest == address::rack;
  switch (message.id) {
    case MessageId::rack_req_bayused:
      reply_short(MessageId::rack_get_bayused, message.param1,
                  message.param1 == params_.bay.value_or(0) ? occupied : vacant, out);
      return true;
    case MessageId::hub_req_bayused:  // of cubes
      if (servo()) reply_short(MessageId::hub_get_bayused, off_the_hub, 0, out);
      return servo();
    case MessageId::rack_req_statusbits:
      if (to_rack) reply(MessageId::rack_get_statusbits, RackStatusBits{rack_outputs_}, out);
      return to_rack;
    case MessageId::rack_set_digoutputs:
      if (to_rack) rack_outputs_ = message.param1;
      return to_rack;
    case MessageId::rack_req_digoutputs:
      if (to_rack) reply_short(MessageId::rack_get_digoutputs, rack_outputs_, 0, out);
      return to_rack;
    default:
      return handle_inputs_and_outputs(message, out);
  }
}

/// Controllers have them; an LTS, whose controller is built in, has not (device-facts.md, APT
/// controllers).
bool AptStageEmulator::handle_inputs_and_outputs(const Message& message, ByteSink& out) {
  if (!lists_end_message_switch()) return false;
  switch (message.id) {
    case MessageId::mod_set_digoutputs:
      outputs_ = message.param1;
      return true;
    case MessageId::mod_req_digoutputs:
      reply_short(MessageId::mod_get_digoutputs, outputs_, 0, out);
      return true;
    case MessageId::req_adcinputs:  // nothing is connected
      reply(MessageId::get_adcinputs, AdcInputs{}, out);
      return true;
    default:
      return false;
  }
}

}  // namespace weft::sim
