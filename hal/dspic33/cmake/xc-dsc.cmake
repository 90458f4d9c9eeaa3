# Toolchain file for Microchip's XC-DSC, the successor of XC16. Looked for in XC_DSC_ROOT (variable or environment), on the
# PATH, and where its installer puts it; the newest version wins. Part support beyond what it ships comes from a device
# family pack: XC_DSC_DFP is the folder xc16 of an unpacked one.
set(PDCP_COMPILER_NAME xc-dsc)
set(PDCP_COMPILER_ROOT XC_DSC_ROOT)
set(PDCP_COMPILER_PLACES ${XC_DSC_ROOT} $ENV{XC_DSC_ROOT})
set(PDCP_COMPILER_GLOB /opt/microchip/xc-dsc/*)
include(${CMAKE_CURRENT_LIST_DIR}/microchip.cmake)
