# Toolchain file for Microchip's XC16. Looked for in XC16_ROOT (variable or environment), on the PATH, and where its
# installer puts it; the newest version wins.
set(PDCP_COMPILER_NAME xc16)
set(PDCP_COMPILER_ROOT XC16_ROOT)
set(PDCP_COMPILER_PLACES ${XC16_ROOT} $ENV{XC16_ROOT})
set(PDCP_COMPILER_GLOB /opt/microchip/xc16/*)
include(${CMAKE_CURRENT_LIST_DIR}/microchip.cmake)
