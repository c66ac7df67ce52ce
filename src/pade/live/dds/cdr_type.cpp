#include "pade/live/dds/cdr_type.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <new>

#include <dds/ddsi/q_radmin.h>

namespace pade::live::cdr_type {
namespace {

/// A message, filled up to a multiple of 4 as the protocol sends it.
struct CdrSample : ddsi_serdata {
  std::string bytes;
  std::uint32_t size = 0;  // without what was filled up
};

const CdrSample* as_sample(const ddsi_serdata* sample) { return static_cast<const CdrSample*>(sample); }

CdrSample* new_sample(const ddsi_sertype* type, ddsi_serdata_kind kind, std::size_t size) {
  auto* const made = new (std::nothrow) CdrSample();
  if (made == nullptr) return nullptr;
  ddsi_serdata_init(made, type, kind);
  made->size = static_cast<std::uint32_t>(size);
  made->bytes.assign((size + 3) / 4 * 4, '\0');
  return made;
}

// Types without keys: all samples are of one instance.
bool eqkey(const ddsi_serdata* /*a*/, const ddsi_serdata* /*b*/) { return true; }
std::uint32_t get_size(const ddsi_serdata* sample) { return as_sample(sample)->size; }

ddsi_serdata* from_ser(const ddsi_sertype* type, ddsi_serdata_kind kind, const nn_rdata* fragment,
                       std::size_t size) {
  CdrSample* const made = new_sample(type, kind, size);
  if (made == nullptr) return nullptr;
  std::size_t known = 0;
  for (; fragment != nullptr; fragment = fragment->nextfrag) {
    if (fragment->maxp1 <= known || fragment->min > known || fragment->maxp1 > size) continue;
    const unsigned char* const payload =
        NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment));  // NOLINT: a macro of C
    std::memcpy(made->bytes.data() + known, payload + (known - fragment->min), fragment->maxp1 - known);
    known = fragment->maxp1;
  }
  if (known == size) return made;
  ddsi_serdata_unref(made);
  return nullptr;
}

ddsi_serdata* from_ser_iov(const ddsi_sertype* type, ddsi_serdata_kind kind, ddsrt_msg_iovlen_t count,
                           const ddsrt_iovec_t* parts, std::size_t size) {
  CdrSample* const made = new_sample(type, kind, size);
  if (made == nullptr) return nullptr;
  std::size_t known = 0;
  for (ddsrt_msg_iovlen_t i = 0; i < count && known < size; ++i) {
    const std::size_t length = std::min<std::size_t>(parts[i].iov_len, size - known);
    std::memcpy(made->bytes.data() + known, parts[i].iov_base, length);
    known += length;
  }
  return made;
}

ddsi_serdata* from_keyhash(const ddsi_sertype* type, const ddsi_keyhash* /*hash*/) {
  return new_sample(type, SDK_KEY, 0);
}

ddsi_serdata* from_sample(const ddsi_sertype* type, ddsi_serdata_kind kind, const void* sample) {
  if (kind != SDK_DATA) return new_sample(type, kind, 0);
  const std::string_view bytes = static_cast<const Sample*>(sample)->bytes;
  CdrSample* const made = new_sample(type, kind, bytes.size());
  if (made == nullptr) return nullptr;
  std::copy(bytes.begin(), bytes.end(), made->bytes.begin());
  // The last bits of the four bytes before a message say how many were filled up.
  if (bytes.size() > 3) made->bytes[3] = static_cast<char>(made->bytes.size() - bytes.size());
  return made;
}

void to_ser(const ddsi_serdata* sample, std::size_t offset, std::size_t size, void* out) {
  std::memcpy(out, as_sample(sample)->bytes.data() + offset, size);
}

ddsi_serdata* to_ser_ref(const ddsi_serdata* sample, std::size_t offset, std::size_t size,
                         ddsrt_iovec_t* out) {
  out->iov_base = const_cast<char*>(as_sample(sample)->bytes.data()) + offset;  // NOLINT: only read
  out->iov_len = static_cast<ddsrt_iov_len_t>(size);
  return ddsi_serdata_ref(sample);
}

void to_ser_unref(ddsi_serdata* sample, const ddsrt_iovec_t* /*part*/) { ddsi_serdata_unref(sample); }

bool to_sample(const ddsi_serdata* /*from*/, void* /*sample*/, void** /*buffer*/, void* /*limit*/) {
  return false;  // samples are taken as they are: dds_takecdr()
}

ddsi_serdata* to_untyped(const ddsi_serdata* sample) {
  CdrSample* const made = new_sample(sample->type, SDK_KEY, 0);
  if (made != nullptr) made->type = nullptr;
  return made;
}

bool untyped_to_sample(const ddsi_sertype* /*type*/, const ddsi_serdata* /*from*/, void* /*sample*/,
                       void** /*buffer*/, void* /*limit*/) {
  return true;
}

void free_sample(ddsi_serdata* sample) { delete static_cast<CdrSample*>(sample); }

std::size_t print(const ddsi_sertype* /*type*/, const ddsi_serdata* /*sample*/, char* out, std::size_t size) {
  constexpr std::string_view kText = "(CDR)";
  if (size == 0) return 0;
  const std::size_t count = std::min(size - 1, kText.size());
  std::copy_n(kText.begin(), count, out);
  out[count] = '\0';
  return count;
}

void get_keyhash(const ddsi_serdata* /*sample*/, ddsi_keyhash* hash, bool /*md5*/) {
  std::memset(hash, 0, sizeof *hash);
}

void free_type(ddsi_sertype* type) {
  ddsi_sertype_fini(type);
  delete type;
}
void zero_samples(const ddsi_sertype* /*type*/, void* /*samples*/, std::size_t /*count*/) {}
void realloc_samples(void** /*samples*/, const ddsi_sertype* /*type*/, void* /*old*/, std::size_t /*before*/,
                     std::size_t /*count*/) {}
void free_samples(const ddsi_sertype* /*type*/, void** /*samples*/, std::size_t /*count*/,
                  dds_free_op_t /*what*/) {}
bool equal(const ddsi_sertype* /*a*/, const ddsi_sertype* /*b*/) {
  return true;
}  // names are compared before
std::uint32_t hash(const ddsi_sertype* /*type*/) { return 0; }

ddsi_serdata_ops sample_operations() {
  ddsi_serdata_ops operations{};
  operations.eqkey = eqkey;
  operations.get_size = get_size;
  operations.from_ser = from_ser;
  operations.from_ser_iov = from_ser_iov;
  operations.from_keyhash = from_keyhash;
  operations.from_sample = from_sample;
  operations.to_ser = to_ser;
  operations.to_ser_ref = to_ser_ref;
  operations.to_ser_unref = to_ser_unref;
  operations.to_sample = to_sample;
  operations.to_untyped = to_untyped;
  operations.untyped_to_sample = untyped_to_sample;
  operations.free = free_sample;
  operations.print = print;
  operations.get_keyhash = get_keyhash;
  return operations;
}

ddsi_sertype_ops type_operations() {
  ddsi_sertype_ops operations{};
  operations.version = ddsi_sertype_v0;
  operations.free = free_type;
  operations.zero_samples = zero_samples;
  operations.realloc_samples = realloc_samples;
  operations.free_samples = free_samples;
  operations.equal = equal;
  operations.hash = hash;
  return operations;
}

const ddsi_serdata_ops kSampleOperations = sample_operations();
const ddsi_sertype_ops kTypeOperations = type_operations();

}  // namespace

ddsi_sertype* create(const std::string& name) {
  auto* const type = new ddsi_sertype{};
  ddsi_sertype_init(type, name.c_str(), &kTypeOperations, &kSampleOperations, true);
  type->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  return type;
}

std::string_view bytes_of(const ddsi_serdata* sample) {
  const CdrSample* const made = as_sample(sample);
  return std::string_view(made->bytes).substr(0, made->size);
}

}  // namespace pade::live::cdr_type
