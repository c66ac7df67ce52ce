// Where the fields of a message lie on the wire, and the CRC_EXTRA that guards them, both computed at compile
// time from the one table that a message has: its `visit`, which names the fields in the order of the
// definition (https://mavlink.io/en/guide/serialization.html).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "pade/live/mavlink/checksum.hpp"

namespace pade::live::mavlink {

/// Marks a field that MAVLink 2 added to a message of MAVLink 1.
struct Extension {};
inline constexpr Extension kExtension{};  ///< third argument of such a field in `visit`

/// One field of a message.
struct FieldLayout {
  std::string_view name;   ///< as in the definition
  std::string_view type;   ///< of one element, as in the definition: "uint16_t"
  std::size_t size = 0;    ///< of one element, bytes
  std::size_t count = 1;   ///< elements
  bool array = false;      ///< also where count is 1
  bool extension = false;  ///< only in MAVLink 2
  std::size_t offset = 0;  ///< on the wire, bytes
};

/// A field's C++ type taken apart.
template <class T>
struct FieldType {
  using Element = T;
  static constexpr std::size_t count = 1;
  static constexpr bool array = false;
};
template <class T, std::size_t n>
struct FieldType<std::array<T, n>> {
  using Element = T;
  static constexpr std::size_t count = n;
  static constexpr bool array = true;
};

/// As the definitions call it.
template <class T>
constexpr std::string_view type_name() {
  if constexpr (std::is_same_v<T, char>) return "char";
  if constexpr (std::is_same_v<T, float>) return "float";
  if constexpr (std::is_same_v<T, double>) return "double";
  if constexpr (std::is_same_v<T, std::uint8_t>) return "uint8_t";
  if constexpr (std::is_same_v<T, std::int8_t>) return "int8_t";
  if constexpr (std::is_same_v<T, std::uint16_t>) return "uint16_t";
  if constexpr (std::is_same_v<T, std::int16_t>) return "int16_t";
  if constexpr (std::is_same_v<T, std::uint32_t>) return "uint32_t";
  if constexpr (std::is_same_v<T, std::int32_t>) return "int32_t";
  if constexpr (std::is_same_v<T, std::uint64_t>) return "uint64_t";
  if constexpr (std::is_same_v<T, std::int64_t>) return "int64_t";
}

namespace detail {

struct CountFields {
  std::size_t count = 0;
  constexpr void operator()(std::string_view /*name*/, const auto& /*value*/) { ++count; }
  constexpr void operator()(std::string_view /*name*/, const auto& /*value*/, Extension /*tag*/) { ++count; }
};

template <class Message>
constexpr std::size_t count_fields() {
  const Message message{};
  CountFields counter;
  Message::visit(message, counter);
  return counter.count;
}

template <std::size_t n>
struct ListFields {
  std::array<FieldLayout, n> fields{};
  std::size_t next = 0;

  template <class T>
  constexpr void add(std::string_view name, bool extension) {
    using Type = FieldType<T>;
    using Element = typename Type::Element;
    fields[next++] = {name, type_name<Element>(), sizeof(Element), Type::count, Type::array, extension, 0};
  }
  template <class T>
  constexpr void operator()(std::string_view name, const T& /*value*/) {
    add<T>(name, false);
  }
  template <class T>
  constexpr void operator()(std::string_view name, const T& /*value*/, Extension /*tag*/) {
    add<T>(name, true);
  }
};

}  // namespace detail

/// The fields of a message in the order of its definition, with their places on the wire: those of
/// MAVLink 1 by falling size of the element, then the extensions as they are listed.
template <class Message>
constexpr auto fields_of() {
  const Message message{};
  detail::ListFields<detail::count_fields<Message>()> list;
  Message::visit(message, list);
  std::size_t offset = 0;
  for (const std::size_t size : {8U, 4U, 2U, 1U}) {
    for (FieldLayout& field : list.fields) {
      if (field.extension || field.size != size) continue;
      field.offset = offset;
      offset += field.size * field.count;
    }
  }
  for (FieldLayout& field : list.fields) {
    if (!field.extension) continue;
    field.offset = offset;
    offset += field.size * field.count;
  }
  return list.fields;
}

/// What a message measures and what guards it.
struct MessageLayout {
  std::size_t base_length = 0;  ///< without extensions: the payload of MAVLink 1, bytes
  std::size_t length = 0;       ///< with them, bytes
  std::uint8_t crc_extra = 0;   ///< of name, types and names of the base fields, in the order of the wire
};

template <class Message>
constexpr MessageLayout layout_of() {
  const auto fields = fields_of<Message>();
  MessageLayout layout;
  Checksum checksum;
  const auto add_text = [&](std::string_view text) {
    for (const char letter : text) checksum.add(static_cast<std::uint8_t>(letter));
    checksum.add(' ');
  };
  add_text(Message::kName);
  for (const std::size_t size : {8U, 4U, 2U, 1U}) {
    for (const FieldLayout& field : fields) {
      if (field.extension || field.size != size) continue;
      add_text(field.type);
      add_text(field.name);
      if (field.array) checksum.add(static_cast<std::uint8_t>(field.count));
    }
  }
  for (const FieldLayout& field : fields) {
    layout.length += field.size * field.count;
    if (!field.extension) layout.base_length += field.size * field.count;
  }
  layout.crc_extra =
      static_cast<std::uint8_t>((checksum.value() & 0xffU) ^ (static_cast<unsigned>(checksum.value()) >> 8U));
  return layout;
}

}  // namespace pade::live::mavlink
