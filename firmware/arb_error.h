/* Error codes of failure answers to the host (D-API-4). Storage and limb return them too, so they stand below
 * the host API. */
#ifndef ARB_ERROR_H
#define ARB_ERROR_H

enum {
    ARB_OK = 0,
    ARB_ERR_SIZE = 0x01,
    ARB_ERR_NUMBER = 0x02,
    ARB_ERR_DEVICE = 0x03,
    ARB_ERR_CHANNEL = 0x04,
    ARB_ERR_NO_ANSWER = 0x05,
    ARB_ERR_REFUSED = 0x06,
    ARB_ERR_BUSY = 0x07,
    ARB_ERR_SOLE_ACCESS = 0x08,
    ARB_ERR_NO_NODE_ID = 0x09,
    ARB_ERR_BULK = 0x0A,
    ARB_ERR_NOT_READY = 0x0B,
    ARB_ERR_CRC = 0x0C,
    ARB_ERR_STORAGE = 0x0D,
    ARB_ERR_NOT_SUPPORTED = 0x0E,
    ARB_ERR_VALUE = 0x0F
};

#endif
