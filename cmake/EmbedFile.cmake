# cmake -DINPUT= -DOUTPUT= -DNAME= -DHEADER= -DNAMESPACE= -P EmbedFile.cmake: a C++ file that holds INPUT's bytes.
file(READ ${INPUT} bytes HEX)
string(REGEX REPLACE "(..)" "0x\\1," bytes "${bytes}")
file(WRITE ${OUTPUT} "#include \"${HEADER}\"

namespace ${NAMESPACE} {
namespace {

constexpr unsigned char ${NAME}_bytes[] = {
${bytes}
};

}  // namespace

const std::string_view ${NAME}(reinterpret_cast<const char*>(${NAME}_bytes), sizeof ${NAME}_bytes);

}  // namespace ${NAMESPACE}
")
