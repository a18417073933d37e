!> An HDF5 file made in memory: groups, datasets with unit and long name, dimension scales, attributes.
!>
!> What is written goes to the group that is told to write it. Nothing remembers where the writer is and
!> nothing has to be closed, so no way through a procedure can put a thing into another's group.
!>
!> In memory, because then the disk sees one write of finished bytes, whose failure has a reason, and
!> HDF5 itself never meets a full disk. The first call that fails is remembered and the later ones do
!> nothing, so the caller asks once, at the end. Object times are off: the same content gives the same
!> bytes.
module hdf5_writing
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_loc, c_null_char, c_null_ptr, c_ptr
   use failures, only: fail, failure_t, status_run_failed
   use h5ds, only: h5dsattach_scale_f, h5dsset_scale_f
   use hdf5, only: &
      & h5aclose_f, h5acreate_f, h5awrite_f, h5dclose_f, h5dcreate_f, h5dopen_f, h5dwrite_f, h5eset_auto_f, &
      & h5fclose_f, h5fcreate_f, h5fflush_f, h5fget_file_image_f, h5gcreate_f, h5open_f, &
      & h5pclose_f, h5pcreate_f, h5pset_attr_phase_change_f, h5pset_fapl_core_f, h5pset_fclose_degree_f, &
      & h5pset_libver_bounds_f, h5pset_link_creation_order_f, h5pset_obj_track_times_f, h5sclose_f, &
      & h5screate_f, h5screate_simple_f, h5tclose_f, h5tcopy_f, h5tset_cset_f, hid_t, hsize_t, size_t, &
      & h5f_acc_trunc_f, h5f_close_strong_f, h5f_libver_earliest_f, h5f_libver_v18_f, h5f_scope_local_f, &
      & h5p_crt_order_indexed_f, h5p_crt_order_tracked_f, h5p_dataset_create_f, h5p_file_access_f, &
      & h5p_file_create_f, h5p_group_create_f, h5s_scalar_f, h5t_cset_utf8_f, h5t_native_double, &
      & h5t_native_integer, h5t_string
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: hdf5_group_t, open_hdf5, c_free

   !> Up to so many attributes are kept with their object, where HDF5 finds them fastest.
   integer, parameter :: compact_attributes = 64
   !> The extent of a scalar, and the scales of what goes along none.
   integer(hsize_t), parameter :: no_extent(0) = 0_hsize_t
   character(*), parameter :: no_scales(0) = ''

   !> What the groups of a file share.
   type :: file_t
      integer(hid_t) :: id = -1_hid_t
      !> Creation properties and the type of texts
      integer(hid_t) :: group_properties = -1_hid_t
      integer(hid_t) :: dataset_properties = -1_hid_t
      integer(hid_t) :: text_type = -1_hid_t
      !> Where HDF5 refused first; unallocated: nowhere
      character(:), allocatable :: refused
   end type file_t

   !> A group; `begin` makes the root of a file, `finish` ends the file and all its groups.
   type :: hdf5_group_t
      private
      type(file_t), pointer :: file => null()
      integer(hid_t) :: id = -1_hid_t
   contains
      procedure :: begin
      procedure :: finish
      !> A new group in this one
      procedure :: group
      !> A dataset: name, values, units, long name; then the dimension scale it goes along, or that it is one
      generic :: add => add_real, add_reals, add_real_table, add_integer, add_integers, add_text, add_texts
      !> An attribute of the group, or of a dataset in it: name, value, dataset
      generic :: note => note_text, note_real, note_reals, note_integers
      procedure, private :: add_real, add_reals, add_real_table, add_integer, add_integers, add_text, add_texts
      procedure, private :: note_text, note_real, note_reals, note_integers
      procedure, private :: check, add_dataset, describe, open_object, close_object, write_attribute
   end type hdf5_group_t

   !> The library has been started: each further start would leave copies of its types behind.
   logical :: is_open = .false.

   interface
      !> POSIX: set an environment variable; without `overwrite` one that is set stays.
      function posix_setenv(name, value, overwrite) bind(c, name='setenv') result(status)
         import :: c_char, c_int
         implicit none (type, external)
         character(kind=c_char), intent(in) :: name(*)
         character(kind=c_char), intent(in) :: value(*)
         integer(c_int), value :: overwrite
         integer(c_int) :: status
      end function posix_setenv

      !> C: give memory back, here that of a text which HDF5 read.
      subroutine c_free(address) bind(c, name='free')
         import :: c_ptr
         implicit none (type, external)
         type(c_ptr), value :: address
      end subroutine c_free
   end interface

contains

   !> Start the library, at the first call.
   subroutine open_hdf5(status)
      !> What HDF5 returned: negative is a failure
      integer, intent(out) :: status

      integer :: quiet_status

      status = 0
      ! The program has a lock of its own, and HDF5's keeps files from being opened on disks that have none.
      if (.not. is_open) then
         quiet_status = posix_setenv('HDF5_USE_FILE_LOCKING'//c_null_char, 'FALSE'//c_null_char, 0_c_int)
         call h5open_f(status)
      end if
      is_open = status == 0
      ! What fails is told by who asked. Each thread has a setting of its own, so each that comes here is silenced.
      call h5eset_auto_f(0, quiet_status)
   end subroutine open_hdf5

   !> Start an empty file.
   subroutine begin(self, expected_size)
      !> Its root
      class(hdf5_group_t), intent(out) :: self
      !> About so many bytes will come
      integer(size_t), intent(in) :: expected_size

      integer(size_t), parameter :: smallest_increment = 65536_size_t
      integer :: order, status
      integer(hid_t) :: access, creation

      allocate (self%file)
      call open_hdf5(status)
      call self%check(status, 'starting the library')

      call h5pcreate_f(h5p_file_access_f, access, status)
      call h5pset_fapl_core_f(access, max(smallest_increment, expected_size), .false., status)
      call self%check(status, 'the file in memory')
      ! The first superblock: h5fget_file_image_f (HDF5 1.10.8) spoils the checksum of the later ones.
      call h5pset_libver_bounds_f(access, h5f_libver_earliest_f, h5f_libver_v18_f, status)
      call h5pset_fclose_degree_f(access, h5f_close_strong_f, status)

      order = ior(h5p_crt_order_tracked_f, h5p_crt_order_indexed_f)
      call h5pcreate_f(h5p_file_create_f, creation, status)
      call h5pset_link_creation_order_f(creation, order, status)
      call h5pset_obj_track_times_f(creation, .false., status)
      call h5pset_attr_phase_change_f(creation, compact_attributes, 0, status)
      call h5pcreate_f(h5p_group_create_f, self%file%group_properties, status)
      call h5pset_link_creation_order_f(self%file%group_properties, order, status)
      call h5pset_obj_track_times_f(self%file%group_properties, .false., status)
      call h5pset_attr_phase_change_f(self%file%group_properties, compact_attributes, 0, status)
      call h5pcreate_f(h5p_dataset_create_f, self%file%dataset_properties, status)
      call h5pset_obj_track_times_f(self%file%dataset_properties, .false., status)
      call self%check(status, 'the creation properties')

      ! h5t_string is of variable length already, ended by a null as in C.
      call h5tcopy_f(h5t_string, self%file%text_type, status)
      call h5tset_cset_f(self%file%text_type, h5t_cset_utf8_f, status)
      call self%check(status, 'the type of texts')

      ! The name stays in memory too.
      call h5fcreate_f('results', h5f_acc_trunc_f, self%file%id, status, creation, access)
      call self%check(status, 'the file in memory')
      call h5pclose_f(creation, status)
      call h5pclose_f(access, status)
      self%id = self%file%id
   end subroutine begin

   !> Close the file and give its bytes.
   subroutine finish(self, bytes, error)
      !> Its root; neither it nor any other group of the file can be used hereafter
      class(hdf5_group_t), intent(inout) :: self
      !> The finished file
      character(kind=c_char), allocatable, target, intent(out) :: bytes(:)
      !> What HDF5 refused
      type(failure_t), allocatable, intent(out) :: error

      integer :: status
      integer(size_t) :: length
      type(c_ptr) :: buffer

      length = 0_size_t
      if (.not. allocated(self%file%refused)) then
         call h5fflush_f(self%file%id, h5f_scope_local_f, status)
         call self%check(status, 'finishing the file')
         buffer = c_null_ptr
         call h5fget_file_image_f(self%file%id, buffer, 0_size_t, status, length)
         call self%check(status, 'finishing the file')
      end if
      allocate (bytes(length))
      if (.not. allocated(self%file%refused) .and. length > 0_size_t) then
         buffer = c_loc(bytes)
         call h5fget_file_image_f(self%file%id, buffer, length, status)
         call self%check(status, 'finishing the file')
      end if

      call h5tclose_f(self%file%text_type, status)
      call h5pclose_f(self%file%dataset_properties, status)
      call h5pclose_f(self%file%group_properties, status)
      call h5fclose_f(self%file%id, status)
      if (allocated(self%file%refused)) call fail(error, status_run_failed, 'HDF5 failed at '//self%file%refused)
      deallocate (self%file)
   end subroutine finish

   !> Make a group in this one.
   function group(self, name) result(made)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> The new group's name
      character(*), intent(in) :: name
      type(hdf5_group_t) :: made

      integer :: status

      made%file => self%file
      if (allocated(self%file%refused)) return
      call h5gcreate_f(self%id, name, made%id, status, gcpl_id=self%file%group_properties)
      call self%check(status, name)
   end function group

   !> One number.
   subroutine add_real(self, name, value, units, long_name)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> The dataset's name, value, unit and meaning
      character(*), intent(in) :: name
      real(wp), target, intent(in) :: value
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name

      call self%add_dataset(name, h5t_native_double, c_loc(value), no_extent, units, long_name, no_scales)
   end subroutine add_real

   !> A list of numbers.
   subroutine add_reals(self, name, values, units, long_name, along, is_scale)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> The dataset's name, values, unit and meaning
      character(*), intent(in) :: name
      real(wp), contiguous, target, intent(in) :: values(:)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      !> The dimension scale of this group that it goes along
      character(*), intent(in), optional :: along
      !> It is a dimension scale itself
      logical, intent(in), optional :: is_scale

      call self%add_dataset(name, h5t_native_double, address_of(values), [size(values, kind=hsize_t)], &
                            units, long_name, as_list(along), is_scale)
   end subroutine add_reals

   !> A table of numbers. Readers in C and Python see its dimensions in reverse.
   subroutine add_real_table(self, name, values, units, long_name, along)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> The dataset's name, values, unit and meaning
      character(*), intent(in) :: name
      real(wp), contiguous, target, intent(in) :: values(:, :)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      !> The dimension scales of this group for the first and the second index
      character(*), intent(in) :: along(2)

      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
      call self%add_dataset(name, h5t_native_double, address, shape(values, kind=hsize_t), units, long_name, along)
   end subroutine add_real_table

   !> One integer.
   subroutine add_integer(self, name, value, units, long_name)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> The dataset's name, value, unit and meaning
      character(*), intent(in) :: name
      integer, target, intent(in) :: value
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name

      call self%add_dataset(name, h5t_native_integer, c_loc(value), no_extent, units, long_name, no_scales)
   end subroutine add_integer

   !> A list of integers.
   subroutine add_integers(self, name, values, units, long_name, along, is_scale)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> The dataset's name, values, unit and meaning
      character(*), intent(in) :: name
      integer, contiguous, target, intent(in) :: values(:)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      !> The dimension scale of this group that it goes along
      character(*), intent(in), optional :: along
      !> It is a dimension scale itself
      logical, intent(in), optional :: is_scale

      call self%add_dataset(name, h5t_native_integer, address_of_integers(values), [size(values, kind=hsize_t)], &
                            units, long_name, as_list(along), is_scale)
   end subroutine add_integers

   !> One text.
   subroutine add_text(self, name, text, units, long_name)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> The dataset's name, text, unit ('none') and meaning
      character(*), intent(in) :: name
      character(*), intent(in) :: text
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name

      character(:), allocatable, target :: terminated
      type(c_ptr), target :: address

      terminated = text//c_null_char
      address = c_loc(terminated)
      call self%add_dataset(name, self%file%text_type, c_loc(address), no_extent, units, long_name, no_scales)
   end subroutine add_text

   !> A list of texts; blanks at their ends are cut.
   subroutine add_texts(self, name, texts, units, long_name, along)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> The dataset's name, texts, unit ('none') and meaning
      character(*), intent(in) :: name
      character(*), intent(in) :: texts(:)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      !> The dimension scale of this group that it goes along
      character(*), intent(in) :: along

      character(len(texts) + 1), target :: terminated(size(texts))
      integer :: i
      type(c_ptr), target :: addresses(size(texts))
      type(c_ptr) :: address

      do i = 1, size(texts)
         terminated(i) = trim(texts(i))//c_null_char
         addresses(i) = c_loc(terminated(i))
      end do
      address = c_null_ptr
      if (size(texts) > 0) address = c_loc(addresses)
      call self%add_dataset(name, self%file%text_type, address, [size(texts, kind=hsize_t)], units, long_name, [along])
   end subroutine add_texts

   !> An attribute that is a text.
   subroutine note_text(self, name, text, dataset)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> The attribute's name and text
      character(*), intent(in) :: name
      character(*), intent(in) :: text
      !> Dataset of the group that it belongs to; absent: it belongs to the group
      character(*), intent(in), optional :: dataset

      integer(hid_t) :: object

      call self%open_object(object, dataset)
      call self%describe(object, name, text)
      call self%close_object(object, dataset)
   end subroutine note_text

   !> An attribute that is a number.
   subroutine note_real(self, name, value, dataset)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> The attribute's name and value
      character(*), intent(in) :: name
      real(wp), target, intent(in) :: value
      !> Dataset of the group that it belongs to; absent: it belongs to the group
      character(*), intent(in), optional :: dataset

      integer(hid_t) :: object

      call self%open_object(object, dataset)
      call self%write_attribute(object, name, h5t_native_double, c_loc(value))
      call self%close_object(object, dataset)
   end subroutine note_real

   !> An attribute that is a list of numbers.
   subroutine note_reals(self, name, values, dataset)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> The attribute's name and values
      character(*), intent(in) :: name
      real(wp), contiguous, target, intent(in) :: values(:)
      !> Dataset of the group that it belongs to; absent: it belongs to the group
      character(*), intent(in), optional :: dataset

      integer(hid_t) :: object

      call self%open_object(object, dataset)
      call self%write_attribute(object, name, h5t_native_double, address_of(values), size(values, kind=hsize_t))
      call self%close_object(object, dataset)
   end subroutine note_reals

   !> An attribute that is a list of integers.
   subroutine note_integers(self, name, values, dataset)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> The attribute's name and values
      character(*), intent(in) :: name
      integer, contiguous, target, intent(in) :: values(:)
      !> Dataset of the group that it belongs to; absent: it belongs to the group
      character(*), intent(in), optional :: dataset

      integer(hid_t) :: object

      call self%open_object(object, dataset)
      call self%write_attribute(object, name, h5t_native_integer, address_of_integers(values), &
                                size(values, kind=hsize_t))
      call self%close_object(object, dataset)
   end subroutine note_integers

   !> Remember the first call that failed.
   subroutine check(self, status, name)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> What HDF5 returned: negative is a failure
      integer, intent(in) :: status
      !> What the call was about
      character(*), intent(in) :: name

      if (status < 0 .and. .not. allocated(self%file%refused)) self%file%refused = "'"//name//"'"
   end subroutine check

   !> Make a dataset in the group.
   subroutine add_dataset(self, name, type, address, extent, units, long_name, along, is_scale)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> The dataset's name
      character(*), intent(in) :: name
      !> Its HDF5 type
      integer(hid_t), intent(in) :: type
      !> Its values
      type(c_ptr), intent(in) :: address
      !> Its shape; without elements: a scalar
      integer(hsize_t), intent(in) :: extent(:)
      !> Unit and meaning
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      !> Names of the dimension scales for its indices, if it goes along any
      character(*), intent(in) :: along(:)
      !> It is a dimension scale itself
      logical, intent(in), optional :: is_scale

      integer :: i, status
      integer(hid_t) :: dataset, scale, space

      if (allocated(self%file%refused)) return
      if (size(extent) == 0) then
         call h5screate_f(h5s_scalar_f, space, status)
      else
         call h5screate_simple_f(size(extent), extent, space, status)
      end if
      call self%check(status, name)
      call h5dcreate_f(self%id, name, type, space, dataset, status, dcpl_id=self%file%dataset_properties)
      call self%check(status, name)
      if (.not. allocated(self%file%refused) .and. product(extent) > 0_hsize_t) then
         call h5dwrite_f(dataset, type, address, status)
         call self%check(status, name)
      end if
      if (present(is_scale)) then
         if (is_scale) call h5dsset_scale_f(dataset, status, name)
         call self%check(status, name)
      end if
      call self%describe(dataset, 'long_name', long_name)
      call self%describe(dataset, 'units', units)
      do i = 1, size(along)
         if (allocated(self%file%refused)) exit
         call h5dopen_f(self%id, trim(along(i)), scale, status)
         call self%check(status, trim(along(i)))
         if (allocated(self%file%refused)) exit
         ! This call counts the dimensions from 1, but in C's order.
         call h5dsattach_scale_f(dataset, scale, size(along) + 1 - i, status)
         call self%check(status, trim(along(i)))
         call h5dclose_f(scale, status)
      end do
      call h5dclose_f(dataset, status)
      call h5sclose_f(space, status)
   end subroutine add_dataset

   !> Give an object an attribute that is a text.
   subroutine describe(self, object, name, text)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> Group or dataset
      integer(hid_t), intent(in) :: object
      !> The attribute's name and text
      character(*), intent(in) :: name
      character(*), intent(in) :: text

      character(:), allocatable, target :: terminated
      type(c_ptr), target :: address

      terminated = text//c_null_char
      address = c_loc(terminated)
      call self%write_attribute(object, name, self%file%text_type, c_loc(address))
   end subroutine describe

   !> The group or a dataset in it, open for attributes.
   subroutine open_object(self, object, dataset)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> The object
      integer(hid_t), intent(out) :: object
      !> Name of the dataset; absent: the group
      character(*), intent(in), optional :: dataset

      integer :: status

      object = self%id
      if (allocated(self%file%refused) .or. .not. present(dataset)) return
      call h5dopen_f(self%id, dataset, object, status)
      call self%check(status, dataset)
   end subroutine open_object

   !> Close what `open_object` opened.
   subroutine close_object(self, object, dataset)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> The object
      integer(hid_t), intent(in) :: object
      !> Name of the dataset; absent: the group
      character(*), intent(in), optional :: dataset

      integer :: status

      if (allocated(self%file%refused) .or. .not. present(dataset)) return
      call h5dclose_f(object, status)
   end subroutine close_object

   !> Write an attribute.
   subroutine write_attribute(self, object, name, type, address, length)
      !> The group
      class(hdf5_group_t), intent(in) :: self
      !> Group or dataset
      integer(hid_t), intent(in) :: object
      !> The attribute's name
      character(*), intent(in) :: name
      !> Its HDF5 type
      integer(hid_t), intent(in) :: type
      !> Its values
      type(c_ptr), intent(in) :: address
      !> Number of values; absent: a scalar
      integer(hsize_t), intent(in), optional :: length

      integer :: status
      integer(hid_t) :: attribute, space
      logical :: has_values

      if (allocated(self%file%refused)) return
      has_values = .true.
      if (present(length)) then
         has_values = length > 0_hsize_t
         call h5screate_simple_f(1, [length], space, status)
      else
         call h5screate_f(h5s_scalar_f, space, status)
      end if
      call self%check(status, name)
      call h5acreate_f(object, name, type, space, attribute, status)
      call self%check(status, name)
      if (allocated(self%file%refused)) return
      if (has_values) then
         call h5awrite_f(attribute, type, address, status)
         call self%check(status, name)
      end if
      call h5aclose_f(attribute, status)
      call h5sclose_f(space, status)
   end subroutine write_attribute

   !> The one scale that a list goes along, if any.
   pure function as_list(along) result(list)
      !> Name of the scale
      character(*), intent(in), optional :: along
      character(:), allocatable :: list(:)

      if (present(along)) then
         allocate (list(1), source=[along])
      else
         allocate (character(0) :: list(0))
      end if
   end function as_list

   !> Where numbers are, null if there are none.
   function address_of(values) result(address)
      !> The numbers
      real(wp), contiguous, target, intent(in) :: values(:)
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
   end function address_of

   !> Where integers are, null if there are none.
   function address_of_integers(values) result(address)
      !> The integers
      integer, contiguous, target, intent(in) :: values(:)
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
   end function address_of_integers

end module hdf5_writing
