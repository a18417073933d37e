!> An HDF5 file that is being written, in memory or on the disk: the identifiers and property lists that its groups and
!> columns share.
!>
!> The first failure of an HDF5 call is recorded and later calls do nothing, so the caller tests for failure once, at
!> the end.
module hdf5_file
   use, intrinsic :: iso_c_binding, only: c_associated, c_loc, c_null_char, c_null_ptr, c_ptr
   use failures, only: fail, failure_t, status_run_failed
   use h5ds, only: h5dsset_scale_f
   use hdf5, only: &
      h5aclose_f, h5acreate_f, h5awrite_f, h5dcreate_f, h5dwrite_f, h5fclose_f, h5fcreate_f, &
      h5fflush_f, h5fget_file_image_f, h5gcreate_f, h5pclose_f, h5pcreate_f, h5pset_buffer_f, &
      h5pset_attr_phase_change_f, h5pset_fapl_core_f, h5pset_fclose_degree_f, h5pset_libver_bounds_f, &
      h5pset_link_creation_order_f, h5pset_obj_track_times_f, h5sclose_f, h5screate_f, h5screate_simple_f, &
      h5tclose_f, hid_t, hsize_t, size_t, h5f_acc_trunc_f, h5f_close_strong_f, h5f_libver_earliest_f, &
      h5f_libver_latest_f, h5f_libver_v18_f, h5f_scope_local_f, h5p_crt_order_indexed_f, h5p_crt_order_tracked_f, &
      h5p_dataset_create_f, &
      h5p_dataset_xfer_f, h5p_file_access_f, h5p_file_create_f, h5p_group_create_f, h5s_scalar_f, h5t_native_double
   use hdf5_library, only: make_text_type, open_hdf5
   use hdf5_scales, only: scales_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: hdf5_file_t, no_extent

   !> Extent of one value, which is neither a list nor a table.
   integer(hsize_t), parameter :: no_extent(0) = 0_hsize_t

   !> Maximum number of attributes that HDF5 stores in the header of their object, where access is fastest.
   integer, parameter :: max_compact_attributes = 64

   !> Bytes of the buffer in which HDF5 converts texts to the type of the file. HDF5's default buffer of a megabyte
   !> would be filled with zeros at each write of texts.
   integer(hsize_t), parameter :: text_buffer = 4096_hsize_t

   !> The file. Identifiers are negative until they are opened.
   type :: hdf5_file_t
      !> Identifier of the file, which also stands for its root group
      integer(hid_t) :: id = -1_hid_t
      integer(hid_t) :: text_type = -1_hid_t
      integer(hid_t), private :: group_properties = -1_hid_t
      integer(hid_t), private :: dataset_properties = -1_hid_t
      !> Property list of dataset transfers
      integer(hid_t), private :: transfer_properties = -1_hid_t
      !> Dataspace of a scalar
      integer(hid_t), private :: one_value = -1_hid_t
      type(scales_t), private :: scales
      !> Description of the first HDF5 call that failed; unallocated: none has failed
      character(:), allocatable :: failed_call
   contains
      procedure :: start
      procedure :: take_image
      procedure :: stop
      procedure :: check
      procedure :: make_group
      procedure :: make_dataset
      procedure :: describe
      procedure :: attach
      procedure :: write_attribute
      procedure :: write_text
      procedure, private :: finish_scales
   end type hdf5_file_t

contains

   !> Start an empty file.
   subroutine start(self, name, expected_size)
      class(hdf5_file_t), intent(inout) :: self
      !> Path of the file; for a file in memory any name
      character(*), intent(in) :: name
      !> Estimated size in bytes; if present, the file is made in memory
      integer(size_t), intent(in), optional :: expected_size

      integer(size_t), parameter :: min_increment = 65536_size_t
      integer :: order, status
      integer(hid_t) :: access, creation

      call open_hdf5(status)
      call self%check(status, 'starting the library')
      call h5pcreate_f(h5p_file_access_f, access, status)
      if (present(expected_size)) then
         call h5pset_fapl_core_f(access, max(min_increment, expected_size), .false., status)
      end if
      call self%check(status, 'the file in memory')
      ! The earliest superblock is used because h5fget_file_image_f (HDF5 1.10.8) spoils the checksum of later ones.
      ! A file on the disk may have virtual datasets, which require a later format.
      call h5pset_libver_bounds_f(access, h5f_libver_earliest_f, merge(h5f_libver_v18_f, h5f_libver_latest_f, &
         present(expected_size)), status)
      call h5pset_fclose_degree_f(access, h5f_close_strong_f, status)

      order = ior(h5p_crt_order_tracked_f, h5p_crt_order_indexed_f)
      call h5pcreate_f(h5p_file_create_f, creation, status)
      call h5pset_link_creation_order_f(creation, order, status)
      call h5pset_obj_track_times_f(creation, .false., status)
      call h5pset_attr_phase_change_f(creation, max_compact_attributes, 0, status)
      call h5pcreate_f(h5p_group_create_f, self%group_properties, status)
      call h5pset_link_creation_order_f(self%group_properties, order, status)
      call h5pset_obj_track_times_f(self%group_properties, .false., status)
      call h5pset_attr_phase_change_f(self%group_properties, max_compact_attributes, 0, status)
      call h5pcreate_f(h5p_dataset_create_f, self%dataset_properties, status)
      call h5pset_obj_track_times_f(self%dataset_properties, .false., status)
      call h5pcreate_f(h5p_dataset_xfer_f, self%transfer_properties, status)
      call h5pset_buffer_f(self%transfer_properties, text_buffer, status)
      call self%check(status, 'the creation properties')
      call make_text_type(self%text_type, status)
      call self%check(status, 'the type of texts')
      call h5screate_f(h5s_scalar_f, self%one_value, status)
      call self%check(status, 'the space of one value')

      call h5fcreate_f(name, h5f_acc_trunc_f, self%id, status, creation, access)
      call self%check(status, 'the file '//name)
      call h5pclose_f(creation, status)
      call h5pclose_f(access, status)
   end subroutine start

   !> Return the bytes of a file in memory.
   subroutine take_image(self, bytes)
      class(hdf5_file_t), intent(inout) :: self
      !> Of length 0 if HDF5 has failed
      character(:), allocatable, target, intent(out) :: bytes

      integer :: status
      integer(size_t) :: length
      type(c_ptr) :: buffer

      length = 0_size_t
      call self%finish_scales()
      if (.not. allocated(self%failed_call)) then
         call h5fflush_f(self%id, h5f_scope_local_f, status)
         call self%check(status, 'finishing the file')
         buffer = c_null_ptr
         call h5fget_file_image_f(self%id, buffer, 0_size_t, status, length)
         call self%check(status, 'finishing the file')
      end if
      allocate (character(length) :: bytes)
      if (allocated(self%failed_call) .or. length == 0_size_t) return
      buffer = c_loc(bytes)
      call h5fget_file_image_f(self%id, buffer, length, status)
      call self%check(status, 'finishing the file')
   end subroutine take_image

   !> Close the file and every object that is open in it.
   subroutine stop(self, error)
      class(hdf5_file_t), intent(inout) :: self
      !> First HDF5 call that failed
      type(failure_t), allocatable, intent(out) :: error

      integer :: status

      call self%finish_scales()
      call h5sclose_f(self%one_value, status)
      call h5tclose_f(self%text_type, status)
      call h5pclose_f(self%transfer_properties, status)
      call h5pclose_f(self%dataset_properties, status)
      call h5pclose_f(self%group_properties, status)
      call h5fclose_f(self%id, status)
      call self%check(status, 'closing the file')
      if (allocated(self%failed_call)) call fail(error, status_run_failed, 'HDF5 failed at '//self%failed_call)
   end subroutine stop

   !> Record the first call that failed.
   subroutine check(self, status, what)
      class(hdf5_file_t), intent(inout) :: self
      !> Status that HDF5 returned; negative is a failure
      integer, intent(in) :: status
      !> Description of the call for the message of the failure
      character(*), intent(in) :: what

      if (status < 0 .and. .not. allocated(self%failed_call)) self%failed_call = "'"//what//"'"
   end subroutine check

   !> Make a group in another group, of which `parent` is the identifier.
   integer(hid_t) function make_group(self, parent, name) result(group)
      class(hdf5_file_t), intent(inout) :: self
      integer(hid_t), intent(in) :: parent
      character(*), intent(in) :: name

      integer :: status

      group = -1_hid_t
      if (allocated(self%failed_call)) return
      call h5gcreate_f(parent, name, group, status, gcpl_id=self%group_properties)
      call self%check(status, name)
   end function make_group

   !> Make a dataset and leave it open. Its values are written unless the address is null.
   integer(hid_t) function make_dataset(self, group, name, type_id, extent, address, is_scale) result(dataset)
      class(hdf5_file_t), intent(inout) :: self
      integer(hid_t), intent(in) :: group
      character(*), intent(in) :: name
      !> Type of the values in the file and in memory
      integer(hid_t), intent(in) :: type_id
      !> Shape of the dataset; of size 0 for a scalar. A negative number counts as 0, because gfortran 12 gives an
      !> expression without values the extent -1 in a dummy argument of any rank
      integer(hsize_t), intent(in) :: extent(:)
      type(c_ptr), intent(in) :: address
      !> Whether the dataset is a dimension scale
      logical, intent(in), optional :: is_scale

      integer :: status
      integer(hid_t) :: space_id

      dataset = -1_hid_t
      if (allocated(self%failed_call)) return
      space_id = self%one_value
      if (size(extent) > 0) call h5screate_simple_f(size(extent), max(extent, 0_hsize_t), space_id, status)
      call h5dcreate_f(group, name, type_id, space_id, dataset, status, dcpl_id=self%dataset_properties)
      call self%check(status, name)
      if (.not. allocated(self%failed_call) .and. c_associated(address)) then
         call h5dwrite_f(dataset, type_id, address, status, xfer_prp=self%transfer_properties)
         call self%check(status, name)
      end if
      if (size(extent) > 0) call h5sclose_f(space_id, status)
      if (.not. present(is_scale)) return
      if (is_scale) call h5dsset_scale_f(dataset, status, name)
      call self%check(status, name)
   end function make_dataset

   !> Write the attributes `long_name`, `units` and `in_scene_units` of a dataset.
   subroutine describe(self, dataset, units, long_name, in_scene_units)
      class(hdf5_file_t), intent(inout) :: self
      integer(hid_t), intent(in) :: dataset
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      !> One unit of the dataset in units of the scene; 0 or absent: unknown
      real(wp), target, intent(in), optional :: in_scene_units

      call self%write_text(dataset, 'long_name', long_name)
      call self%write_text(dataset, 'units', units)
      if (.not. present(in_scene_units)) return
      if (in_scene_units > 0.0_wp) then
         call self%write_attribute(dataset, 'in_scene_units', h5t_native_double, no_extent, c_loc(in_scene_units))
      end if
   end subroutine describe

   !> Attach dimension scales to the first dimensions of a dataset, once for each dataset.
   subroutine attach(self, dataset, group, scales, rank)
      class(hdf5_file_t), intent(inout) :: self
      integer(hid_t), intent(in) :: dataset
      !> Group of the scales
      integer(hid_t), intent(in) :: group
      !> Names of the scales, in the order of C: the last index of a Fortran array is number 1
      character(*), intent(in) :: scales(:)
      !> Number of dimensions of the dataset; absent: one for each scale
      integer, intent(in), optional :: rank

      integer :: dimensions, status

      if (allocated(self%failed_call)) return
      dimensions = size(scales)
      if (present(rank)) dimensions = rank
      call self%scales%attach(dataset, dimensions, group, scales, status)
      call self%check(status, trim(scales(1)))
   end subroutine attach

   !> Write to all dimension scales which datasets use them.
   subroutine finish_scales(self)
      class(hdf5_file_t), intent(inout) :: self

      integer :: status

      if (allocated(self%failed_call)) return
      call self%scales%write_uses(self%id, status)
      call self%check(status, 'the dimension scales')
   end subroutine finish_scales

   !> Write an attribute, a value or a list of values.
   subroutine write_attribute(self, object, name, type_id, extent, address)
      class(hdf5_file_t), intent(inout) :: self
      !> Group or dataset
      integer(hid_t), intent(in) :: object
      character(*), intent(in) :: name
      !> Type of the values in the file and in memory
      integer(hid_t), intent(in) :: type_id
      !> Number of values, as for a dataset; empty: one
      integer(hsize_t), intent(in) :: extent(:)
      type(c_ptr), intent(in) :: address

      integer :: status
      integer(hid_t) :: attribute, space_id

      if (allocated(self%failed_call)) return
      space_id = self%one_value
      if (size(extent) > 0) call h5screate_simple_f(1, max(extent, 0_hsize_t), space_id, status)
      call h5acreate_f(object, name, type_id, space_id, attribute, status)
      call self%check(status, name)
      if (allocated(self%failed_call)) return
      if (c_associated(address)) then
         call h5awrite_f(attribute, type_id, address, status)
         call self%check(status, name)
      end if
      call h5aclose_f(attribute, status)
      if (size(extent) > 0) call h5sclose_f(space_id, status)
   end subroutine write_attribute

   !> Write an attribute that is a text.
   subroutine write_text(self, object, name, text)
      class(hdf5_file_t), intent(inout) :: self
      !> Group or dataset
      integer(hid_t), intent(in) :: object
      character(*), intent(in) :: name
      character(*), intent(in) :: text

      character(len(text) + 1), target :: terminated
      type(c_ptr), target :: address

      terminated = text//c_null_char
      address = c_loc(terminated)
      call self%write_attribute(object, name, self%text_type, no_extent, c_loc(address))
   end subroutine write_text

end module hdf5_file
