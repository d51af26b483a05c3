#include "protocols/rdt/discovery.hpp"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <string_view>

namespace weft::protocols::rdt {
namespace {

constexpr std::string_view request_text = "RTA Device DiscoveryRTAD";
constexpr std::string_view reply_text = "RTAD";

namespace field {
constexpr std::uint8_t mac = 0x01;
constexpr std::uint8_t address = 0x02;
constexpr std::uint8_t netmask = 0x03;
constexpr std::uint8_t application = 0x0D;
constexpr std::uint8_t location = 0x86;
constexpr std::uint8_t delay = 0xF2;
}  // namespace field

tl::unexpected<Error> no_message(const char* expected, const std::string& got) {
  return fail(
      {.code = Errc::parse, .what = "discovery message invalid", .expected = expected, .got = got});
}

Bytes begin(std::string_view text) {
  return {text.begin(), text.end()};
}

void append_field(Bytes& out, std::uint8_t tag, ByteView value) {
  out.push_back(tag);
  out.push_back(static_cast<std::uint8_t>(std::min<std::size_t>(value.size(), 255)));
  const ByteView cut = value.first(out.back());
  out.insert(out.end(), cut.begin(), cut.end());
}

void append_text(Bytes& out, std::uint8_t tag, const std::string& text) {
  if (!text.empty()) append_field(out, tag, Bytes(text.begin(), text.end()));
}

std::string text_of(ByteView value) {
  return {value.begin(), value.end()};
}

std::string mac_text(ByteView value) {
  std::string out;
  for (const std::uint8_t byte : value) {
    char pair[4];
    std::snprintf(pair, sizeof pair, "%s%02x", out.empty() ? "" : "-", byte);
    out += pair;
  }
  return out;
}

Bytes mac_bytes(const std::string& text) {
  Bytes out;
  for (std::size_t at = 0; at + 1 < text.size(); at += 3)
    out.push_back(static_cast<std::uint8_t>(std::stoul(text.substr(at, 2), nullptr, 16)));
  return out;
}

Status read_address(ByteView value, Ipv4& address) {
  if (value.size() != address.size())
    return no_message("an address of 4 bytes", std::to_string(value.size()) + " bytes");
  std::ranges::copy(value, address.begin());
  return {};
}

bool is_of_one_host(const Ipv4& address) {
  constexpr std::uint8_t first_group =
      224;  // RFC 1112; higher addresses include the broadcast to all
  return address[0] > 0 && address[0] < first_group;
}

/// Calls `read` with each field after `text`.
Status read_fields(ByteView datagram, std::string_view text,
                   const std::function<Status(std::uint8_t tag, ByteView value)>& read) {
  if (datagram.size() < text.size() || text_of(datagram.first(text.size())) != text)
    return no_message("the first bytes of a discovery message", "other bytes");
  for (ByteView rest = datagram.subspan(text.size()); rest.size() >= 2;) {
    const std::size_t size = rest[1];
    if (rest.size() < 2 + size) return no_message("whole fields", "a truncated field");
    if (Status field = read(rest[0], rest.subspan(2, size)); !field) return field;
    rest = rest.subspan(2 + size);
  }
  return {};
}

}  // namespace

Bytes encode(const DiscoveryRequest& request) {
  Bytes out = begin(request_text);
  append_field(out, field::address, request.reply_to);
  append_field(out, field::delay, std::array{request.delay_ms});
  return out;
}

Bytes encode(const DiscoveryReply& reply) {
  Bytes out = begin(reply_text);
  if (!reply.mac.empty()) append_field(out, field::mac, mac_bytes(reply.mac));
  append_field(out, field::address, reply.address);
  append_field(out, field::netmask, reply.netmask);
  append_text(out, field::application, reply.application);
  append_text(out, field::location, reply.location);
  return out;
}

Result<DiscoveryRequest> decode_discovery_request(ByteView datagram) {
  DiscoveryRequest request;
  bool addressed = false;
  const Status read = read_fields(datagram, request_text, [&](std::uint8_t tag, ByteView value) {
    if (tag == field::delay && value.size() == 1) request.delay_ms = value[0];
    if (tag != field::address) return Status{};
    addressed = true;
    return read_address(value, request.reply_to);
  });
  if (!read) return pass(read.error());
  if (!addressed) return no_message("an address", "no address");
  return request;
}

Result<DiscoveryReply> decode_discovery_reply(ByteView datagram) {
  DiscoveryReply reply;
  bool addressed = false;
  const Status read = read_fields(datagram, reply_text, [&](std::uint8_t tag, ByteView value) {
    if (tag == field::mac) reply.mac = mac_text(value);
    if (tag == field::application) reply.application = text_of(value);
    if (tag == field::location) reply.location = text_of(value);
    if (tag == field::netmask) return read_address(value, reply.netmask);
    if (tag != field::address) return Status{};
    addressed = true;
    return read_address(value, reply.address);
  });
  if (!read) return pass(read.error());
  if (!addressed) return no_message("an address", "no address");
  if (!is_of_one_host(reply.address))
    return no_message("the address of one host", "the address of a group, or 0.0.0.0");
  return reply;
}

}  // namespace weft::protocols::rdt
