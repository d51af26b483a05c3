#include "protocols/modbus/modbus.hpp"

#include <algorithm>
#include <string>

#include "protocols/base/names.hpp"

namespace weft::protocols::modbus {
namespace {

constexpr std::uint8_t exception_bit = 0x80;

constexpr std::uint8_t code_of(Function function) {
  return static_cast<std::uint8_t>(function);
}

void write_all(BigWriter& writer, const Registers& registers) {
  for (const std::uint16_t value : registers.view()) writer.write(value);
}

Registers read_all(BigReader& reader, std::size_t count) {
  Registers registers;
  registers.count = static_cast<std::uint8_t>(count);
  for (std::size_t i = 0; i < count; ++i) registers.values[i] = reader.read<std::uint16_t>();
  return registers;
}

struct RequestWriter {
  BigWriter writer;
  void operator()(const Read& r) {
    writer.write(code_of(r.function)).write(r.address).write(r.count);
  }
  void operator()(const WriteOne& w) {
    writer.write(code_of(Function::write_one)).write(w.address).write(w.value);
  }
  void operator()(const WriteMany& w) {
    const std::uint8_t count = w.registers.count;
    writer.write(code_of(Function::write_many)).write(w.address).write(std::uint16_t{count});
    writer.write(static_cast<std::uint8_t>(2 * count));
    write_all(writer, w.registers);
  }
  void operator()(const Vendor& v) { writer.write(code_of(v.function)).write(v.data); }
};

struct ReplyWriter {
  BigWriter writer;
  void operator()(const ReadReply& r) {
    writer.write(code_of(r.function)).write(static_cast<std::uint8_t>(2 * r.registers.count));
    write_all(writer, r.registers);
  }
  void operator()(const WriteOne& w) { RequestWriter{writer}(w); }
  void operator()(const WroteMany& w) {
    writer.write(code_of(Function::write_many)).write(w.address).write(w.count);
  }
  void operator()(const Vendor& v) { RequestWriter{writer}(v); }
  void operator()(const Exception& e) {
    writer.write(static_cast<std::uint8_t>(e.function | exception_bit));
    writer.write(static_cast<std::uint8_t>(e.code));
  }
};

/// `message` if the PDU had exactly its length. Errors: parse, otherwise.
template <class Message, class Variant>
Result<Variant> whole(const BigReader& reader, const Message& message) {
  if (reader.ok() && reader.remaining() == 0) return Variant(message);
  return fail({.code = Errc::parse, .what = "Modbus message has the wrong length"});
}

tl::unexpected<Error> wrong_count(std::size_t count, std::size_t most) {
  return fail({.code = Errc::range,
               .what = "number of registers in the Modbus message out of range",
               .expected = "1 to " + std::to_string(most),
               .got = std::to_string(count)});
}

tl::unexpected<Error> no_such_function(unsigned code) {
  return fail({.code = Errc::unsupported,
               .what = "Modbus function unknown",
               .expected = "3, 4, 6, 16, 70 or 106",
               .got = std::to_string(code)});
}

Result<Request> decode_read(Function function, BigReader& reader) {
  Read read{function, reader.read<std::uint16_t>(), 0};
  read.count = reader.read<std::uint16_t>();
  if (reader.ok() && (read.count < 1 || read.count > most_read))
    return wrong_count(read.count, most_read);
  return whole<Read, Request>(reader, read);
}

template <class Variant>
Result<Variant> decode_write_one(BigReader& reader) {
  WriteOne write{reader.read<std::uint16_t>(), 0};
  write.value = reader.read<std::uint16_t>();
  return whole<WriteOne, Variant>(reader, write);
}

Result<Request> decode_write_many(BigReader& reader) {
  WriteMany write{reader.read<std::uint16_t>(), {}};
  const std::size_t count = reader.read<std::uint16_t>();
  const std::size_t bytes = reader.read<std::uint8_t>();
  if (!reader.ok()) return fail({.code = Errc::parse, .what = "Modbus write request truncated"});
  if (count < 1 || count > most_written) return wrong_count(count, most_written);
  if (bytes != 2 * count)
    return fail({.code = Errc::range,
                 .what = "length field of the Modbus write request wrong",
                 .expected = std::to_string(2 * count) + " bytes",
                 .got = std::to_string(bytes) + " bytes"});
  write.registers = read_all(reader, count);
  return whole<WriteMany, Request>(reader, write);
}

Result<Reply> decode_read_reply(Function function, BigReader& reader) {
  const std::size_t bytes = reader.read<std::uint8_t>();
  if (bytes % 2 != 0 || bytes == 0 || bytes / 2 > most_read)
    return wrong_count(bytes / 2, most_read);
  return whole<ReadReply, Reply>(reader, ReadReply{function, read_all(reader, bytes / 2)});
}

template <class Variant>
Result<Variant> decode_vendor(Function function, BigReader& reader) {
  const Vendor vendor{function, reader.read<std::uint8_t>()};
  return whole<Vendor, Variant>(reader, vendor);
}

Result<Reply> decode_exception(std::uint8_t code, BigReader& reader) {
  const Exception exception{static_cast<std::uint8_t>(code & ~exception_bit),
                            static_cast<ExceptionCode>(reader.read<std::uint8_t>())};
  return whole<Exception, Reply>(reader, exception);
}

struct Matcher {
  const Request* request;

  bool operator()(const ReadReply& reply) const {
    const auto* read = std::get_if<Read>(request);
    return read != nullptr && read->function == reply.function &&
           read->count == reply.registers.count;
  }
  bool operator()(const WriteOne& reply) const {
    const auto* write = std::get_if<WriteOne>(request);
    return write != nullptr && *write == reply;
  }
  bool operator()(const WroteMany& reply) const {
    const auto* write = std::get_if<WriteMany>(request);
    return write != nullptr && write->address == reply.address &&
           write->registers.count == reply.count;
  }
  bool operator()(const Vendor& reply) const {
    const auto* vendor = std::get_if<Vendor>(request);
    return vendor != nullptr && vendor->function == reply.function;
  }
  bool operator()(const Exception& reply) const {
    Bytes pdu;
    append(pdu, *request);
    return pdu[0] == reply.function;
  }
};

}  // namespace

std::string_view to_string(ExceptionCode code) {
  constexpr NameTable<ExceptionCode, 7> names{
      {{ExceptionCode::illegal_function, "illegal function"},
       {ExceptionCode::illegal_address, "illegal data address"},
       {ExceptionCode::illegal_value, "illegal data value"},
       {ExceptionCode::device_failure, "device failure"},
       {ExceptionCode::acknowledge, "acknowledged, still at work"},
       {ExceptionCode::busy, "device busy"},
       {ExceptionCode::gateway_target_silent, "gateway: no reply from the device"}}};
  for (const auto& [known, name] : names)
    if (known == code) return name;
  return "exception";
}

Registers::Registers(std::span<const std::uint16_t> from)
    : count(static_cast<std::uint8_t>(std::min(from.size(), most_read))) {
  std::copy_n(from.begin(), count, values.begin());
}

void append(Bytes& out, const Request& request) {
  std::visit(RequestWriter{BigWriter(out)}, request);
}

void append(Bytes& out, const Reply& reply) {
  std::visit(ReplyWriter{BigWriter(out)}, reply);
}

Result<Request> decode_request(ByteView pdu) {
  BigReader reader(pdu);
  const auto code = reader.read<std::uint8_t>();
  const auto function = static_cast<Function>(code);
  switch (function) {
    case Function::read_holding:
    case Function::read_input:
      return decode_read(function, reader);
    case Function::write_one:
      return decode_write_one<Request>(reader);
    case Function::write_many:
      return decode_write_many(reader);
    case Function::vendor_stream:
    case Function::vendor_lock:
      return decode_vendor<Request>(function, reader);
  }
  return no_such_function(code);
}

Result<Reply> decode_reply(ByteView pdu) {
  BigReader reader(pdu);
  const auto code = reader.read<std::uint8_t>();
  const auto function = static_cast<Function>(code);
  if ((code & exception_bit) != 0) return decode_exception(code, reader);
  switch (function) {
    case Function::read_holding:
    case Function::read_input:
      return decode_read_reply(function, reader);
    case Function::write_one:
      return decode_write_one<Reply>(reader);
    case Function::write_many: {
      WroteMany wrote{reader.read<std::uint16_t>(), 0};
      wrote.count = reader.read<std::uint16_t>();
      return whole<WroteMany, Reply>(reader, wrote);
    }
    case Function::vendor_stream:
    case Function::vendor_lock:
      return decode_vendor<Reply>(function, reader);
  }
  return no_such_function(code);
}

bool answers(const Reply& reply, const Request& request) {
  return std::visit(Matcher{&request}, reply);
}

}  // namespace weft::protocols::modbus
