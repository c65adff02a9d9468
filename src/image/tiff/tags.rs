//! Owns the list of TIFF's tags and what becomes of each.
//!
//! *read*: it changes what is returned. *refused*: a file that has it, in the way said, is refused in words. *said*: a note
//! says it, the values are those stored. *harmless*: it does not change what a voxel is. A test of the repository reads this
//! table and tries every row.
//!
//! | tag | name | what becomes of it |
//! |---|---|---|
//! | 254 | NewSubfileType | read: pages of another resolution and masks of pages are left out, with a note |
//! | 255 | SubfileType | read: 2 is a page of another resolution |
//! | 256 | ImageWidth | read |
//! | 257 | ImageLength | read |
//! | 258 | BitsPerSample | read: 1 to 32 and 64 unsigned, 8, 16, 32, 64 signed, 16, 32, 64 float; others refused |
//! | 259 | Compression | read: none, deflate, LZW, PackBits, Zstandard, JPEG, CCITT group 4; others refused by name |
//! | 262 | PhotometricInterpretation | read: 0 and 1 grey as stored (0 said), 2 only where grey, 3 by its table; others refused |
//! | 263 | Threshholding | harmless |
//! | 264 | CellWidth | harmless |
//! | 265 | CellLength | harmless |
//! | 266 | FillOrder | read |
//! | 269 | DocumentName | harmless |
//! | 270 | ImageDescription | read: ImageJ's notes, OME-XML, tifffile's shape |
//! | 271 | Make | harmless |
//! | 272 | Model | harmless |
//! | 273 | StripOffsets | read |
//! | 274 | Orientation | said: rows and columns stay as stored |
//! | 277 | SamplesPerPixel | read: grey, grey with opacity, equal red, green and blue; others refused |
//! | 278 | RowsPerStrip | read |
//! | 279 | StripByteCounts | read |
//! | 280 | MinSampleValue | harmless |
//! | 281 | MaxSampleValue | harmless |
//! | 282 | XResolution | read: unless it is a printer's |
//! | 283 | YResolution | read: unless it is a printer's |
//! | 284 | PlanarConfiguration | refused: 2 with several samples |
//! | 285 | PageName | harmless |
//! | 286 | XPosition | harmless |
//! | 287 | YPosition | harmless |
//! | 288 | FreeOffsets | harmless |
//! | 289 | FreeByteCounts | harmless |
//! | 290 | GrayResponseUnit | harmless |
//! | 291 | GrayResponseCurve | harmless |
//! | 292 | T4Options | harmless |
//! | 293 | T6Options | harmless |
//! | 296 | ResolutionUnit | read |
//! | 297 | PageNumber | harmless |
//! | 301 | TransferFunction | harmless |
//! | 305 | Software | harmless |
//! | 306 | DateTime | harmless |
//! | 315 | Artist | harmless |
//! | 316 | HostComputer | harmless |
//! | 317 | Predictor | read: 1, 2, 3 |
//! | 318 | WhitePoint | harmless |
//! | 319 | PrimaryChromaticities | harmless |
//! | 320 | ColorMap | read: grey and inverted tables; others only from ImageJ, whose labels have them |
//! | 321 | HalftoneHints | harmless |
//! | 322 | TileWidth | read |
//! | 323 | TileLength | read |
//! | 324 | TileOffsets | read |
//! | 325 | TileByteCounts | read |
//! | 330 | SubIFDs | harmless |
//! | 332 | InkSet | harmless |
//! | 336 | DotRange | harmless |
//! | 338 | ExtraSamples | read: opacity is left out, with a note; multiplied values refused |
//! | 339 | SampleFormat | read: complex numbers refused |
//! | 340 | SMinSampleValue | harmless |
//! | 341 | SMaxSampleValue | harmless |
//! | 342 | TransferRange | harmless |
//! | 347 | JPEGTables | read |
//! | 700 | XMP | harmless |
//! | 32997 | ImageDepth | refused: above 1 |
//! | 33432 | Copyright | harmless |
//! | 33629 | UIC2Tag (MetaMorph STK) | refused |
//! | 34412 | CZ_LSMINFO (Zeiss LSM) | refused |
//! | 42112 | GDAL_METADATA | said: scale and offset in it are not applied |
//! | 42113 | GDAL_NODATA | said |
//! | 50838 | ImageJ's sizes of its notes | harmless |
//! | 50839 | ImageJ's labels and overlays | harmless |
