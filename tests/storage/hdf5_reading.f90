!> Reads HDF5 files for tests. What is not there is read as nothing: an empty list, an empty text.
module hdf5_reading
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_loc, c_null_char, c_ptr
   use h5ds, only: h5dsis_attached_f, h5dsis_scale_f
   use hdf5, only: h5aclose_f, h5aexists_by_name_f, h5aget_type_f, h5aopen_by_name_f, h5aread_f, h5dclose_f, &
      h5dget_space_f, h5dget_type_f, h5dopen_f, h5dread_f, h5eset_auto_f, h5f_acc_rdonly_f, h5fclose_f, &
      h5fopen_f, h5g_dataset_f, h5g_group_f, h5gget_obj_info_idx_f, h5gn_members_f, h5lexists_f, h5open_f, &
      h5sclose_f, h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, h5sget_simple_extent_npoints_f, &
      h5t_float_f, h5t_native_double, h5tclose_f, h5tget_class_f, hid_t, hsize_t
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: opens, has_object, shape_of, read_reals, read_text, read_attribute, read_number_attribute
   public :: is_scale, goes_along, not_finite

   interface
      !> C: give memory back, here that of texts which HDF5 read.
      subroutine c_free(address) bind(c, name='free')
         import :: c_ptr
         implicit none (type, external)
         type(c_ptr), value :: address
      end subroutine c_free
   end interface

   !> The library has been started.
   logical :: is_open = .false.

contains

   !> Is it an HDF5 file?
   function opens(file) result(answer)
      !> Name of the file
      character(*), intent(in) :: file
      logical :: answer

      integer :: status
      integer(hid_t) :: handle

      handle = open_file(file)
      answer = handle >= 0_hid_t
      if (answer) call h5fclose_f(handle, status)
   end function opens

   !> Is there a group or a dataset of this name?
   function has_object(file, path) result(answer)
      !> Name of the file
      character(*), intent(in) :: file
      !> Path of the object in it
      character(*), intent(in) :: path
      logical :: answer

      integer :: status
      integer(hid_t) :: handle

      handle = open_file(file)
      call find(handle, path, answer)
      call h5fclose_f(handle, status)
   end function has_object

   !> Extents of a dataset, first index first as Fortran writes it.
   function shape_of(file, path) result(extents)
      !> Name of the file
      character(*), intent(in) :: file
      !> Path of the dataset in it
      character(*), intent(in) :: path
      integer, allocatable :: extents(:)

      integer :: rank, status
      integer(hid_t) :: dataset, handle, space
      integer(hsize_t) :: actual(8), largest(8)
      logical :: exists

      allocate (extents(0))
      handle = open_file(file)
      call find(handle, path, exists)
      if (exists) then
         call h5dopen_f(handle, path, dataset, status)
         call h5dget_space_f(dataset, space, status)
         call h5sget_simple_extent_ndims_f(space, rank, status)
         if (rank > 0) call h5sget_simple_extent_dims_f(space, actual(:rank), largest(:rank), status)
         extents = int(actual(:rank))
         call h5sclose_f(space, status)
         call h5dclose_f(dataset, status)
      end if
      call h5fclose_f(handle, status)
   end function shape_of

   !> All numbers of a dataset, first index fastest.
   function read_reals(file, path) result(values)
      !> Name of the file
      character(*), intent(in) :: file
      !> Path of the dataset in it
      character(*), intent(in) :: path
      real(wp), allocatable :: values(:)

      integer :: status
      integer(hid_t) :: handle
      logical :: exists

      allocate (values(0))
      handle = open_file(file)
      call find(handle, path, exists)
      if (exists) values = numbers_in(handle, path)
      call h5fclose_f(handle, status)
   end function read_reals

   !> All numbers of a dataset of an open file.
   function numbers_in(handle, path) result(values)
      !> The file
      integer(hid_t), intent(in) :: handle
      !> Path of the dataset in it, which is there
      character(*), intent(in) :: path
      real(wp), allocatable :: values(:)

      integer :: status
      integer(hid_t) :: dataset, space
      integer(hsize_t) :: count
      type(c_ptr) :: place
      real(wp), allocatable, target :: buffer(:)

      call h5dopen_f(handle, path, dataset, status)
      call h5dget_space_f(dataset, space, status)
      call h5sget_simple_extent_npoints_f(space, count, status)
      call h5sclose_f(space, status)
      allocate (buffer(count))
      if (count > 0) then
         place = c_loc(buffer)
         call h5dread_f(dataset, h5t_native_double, place, status)
      end if
      call h5dclose_f(dataset, status)
      call move_alloc(buffer, values)
   end function numbers_in

   !> The first text of a dataset.
   function read_text(file, path, place) result(text)
      !> Name of the file
      character(*), intent(in) :: file
      !> Path of the dataset in it
      character(*), intent(in) :: path
      !> Number of the text in the dataset; default: the first
      integer, intent(in), optional :: place
      character(:), allocatable :: text

      integer :: i, status
      integer(hid_t) :: dataset, handle, type
      logical :: exists
      type(c_ptr) :: start
      type(c_ptr), allocatable, target :: addresses(:)

      text = ''
      handle = open_file(file)
      call find(handle, path, exists)
      if (exists) then
         allocate (addresses(max(1, product(shape_of(file, path)))))
         call h5dopen_f(handle, path, dataset, status)
         call h5dget_type_f(dataset, type, status)
         start = c_loc(addresses)
         call h5dread_f(dataset, type, start, status)
         i = 1
         if (present(place)) i = place
         text = text_at(addresses(i))
         do i = 1, size(addresses)
            call c_free(addresses(i))
         end do
         call h5tclose_f(type, status)
         call h5dclose_f(dataset, status)
      end if
      call h5fclose_f(handle, status)
   end function read_text

   !> An attribute that is a text.
   function read_attribute(file, path, name) result(text)
      !> Name of the file
      character(*), intent(in) :: file
      !> Path of the object in it, '/' for the file itself
      character(*), intent(in) :: path
      !> Name of the attribute
      character(*), intent(in) :: name
      character(:), allocatable :: text

      integer :: status
      integer(hid_t) :: attribute, handle, type
      logical :: exists
      type(c_ptr) :: place
      type(c_ptr), target :: address

      text = ''
      handle = open_file(file)
      call find_attribute(handle, path, name, exists)
      if (exists) then
         call h5aopen_by_name_f(handle, path, name, attribute, status)
         call h5aget_type_f(attribute, type, status)
         place = c_loc(address)
         call h5aread_f(attribute, type, place, status)
         text = text_at(address)
         call c_free(address)
         call h5tclose_f(type, status)
         call h5aclose_f(attribute, status)
      end if
      call h5fclose_f(handle, status)
   end function read_attribute

   !> An attribute that is a number; a huge negative one, if there is none.
   function read_number_attribute(file, path, name) result(number)
      !> Name of the file
      character(*), intent(in) :: file
      !> Path of the object in it, '/' for the file itself
      character(*), intent(in) :: path
      !> Name of the attribute
      character(*), intent(in) :: name
      real(wp) :: number

      integer :: status
      integer(hid_t) :: attribute, handle
      logical :: exists
      type(c_ptr) :: place
      real(wp), target :: buffer

      buffer = -huge(1.0_wp)
      handle = open_file(file)
      call find_attribute(handle, path, name, exists)
      if (exists) then
         call h5aopen_by_name_f(handle, path, name, attribute, status)
         place = c_loc(buffer)
         call h5aread_f(attribute, h5t_native_double, place, status)
         call h5aclose_f(attribute, status)
      end if
      call h5fclose_f(handle, status)
      number = buffer
   end function read_number_attribute

   !> Is the dataset a dimension scale?
   function is_scale(file, path) result(answer)
      !> Name of the file
      character(*), intent(in) :: file
      !> Path of the dataset in it
      character(*), intent(in) :: path
      logical :: answer

      integer :: status
      integer(hid_t) :: dataset, handle

      handle = open_file(file)
      call find(handle, path, answer)
      if (answer) then
         call h5dopen_f(handle, path, dataset, status)
         call h5dsis_scale_f(dataset, answer, status)
         call h5dclose_f(dataset, status)
      end if
      call h5fclose_f(handle, status)
   end function is_scale

   !> Does a dataset go along a dimension scale?
   function goes_along(file, path, scale, dimension) result(answer)
      !> Name of the file
      character(*), intent(in) :: file
      !> Paths of the dataset and of the scale
      character(*), intent(in) :: path
      character(*), intent(in) :: scale
      !> The dimension, the last of Fortran's being 1
      integer, intent(in) :: dimension
      logical :: answer

      integer :: status
      integer(hid_t) :: dataset, handle, scale_dataset
      logical :: exists

      handle = open_file(file)
      call find(handle, path, answer)
      call find(handle, scale, exists)
      answer = answer .and. exists
      if (answer) then
         call h5dopen_f(handle, path, dataset, status)
         call h5dopen_f(handle, scale, scale_dataset, status)
         call h5dsis_attached_f(dataset, scale_dataset, dimension, answer, status)
         call h5dclose_f(scale_dataset, status)
         call h5dclose_f(dataset, status)
      end if
      call h5fclose_f(handle, status)
   end function goes_along

   !> The datasets of a file that hold a number which is not finite, each path between blanks.
   function not_finite(file) result(paths)
      !> Name of the file
      character(*), intent(in) :: file
      character(:), allocatable :: paths

      integer(hid_t) :: handle
      integer :: status

      paths = ' '
      handle = open_file(file)
      if (handle < 0_hid_t) return
      call look_into_group(handle, '/', paths)
      call h5fclose_f(handle, status)
   end function not_finite

   !> The same for one group and those in it.
   recursive subroutine look_into_group(handle, group, paths)
      !> The open file
      integer(hid_t), intent(in) :: handle
      !> Path of the group, ending in '/'
      character(*), intent(in) :: group
      !> Gets the paths
      character(:), allocatable, intent(inout) :: paths

      real(wp), allocatable :: numbers(:)
      character(64) :: name
      integer :: class, i, kind, members, status
      integer(hid_t) :: dataset, type

      call h5gn_members_f(handle, group, members, status)
      do i = 0, members - 1
         call h5gget_obj_info_idx_f(handle, group, i, name, kind, status)
         if (kind == h5g_group_f) call look_into_group(handle, group//trim(name)//'/', paths)
         if (kind /= h5g_dataset_f) cycle
         call h5dopen_f(handle, group//trim(name), dataset, status)
         call h5dget_type_f(dataset, type, status)
         call h5tget_class_f(type, class, status)
         call h5tclose_f(type, status)
         call h5dclose_f(dataset, status)
         if (class /= h5t_float_f) cycle
         if (allocated(numbers)) deallocate (numbers)
         allocate (numbers, source=numbers_in(handle, group//trim(name)))
         if (.not. all(ieee_is_finite(numbers))) then
            paths = paths//group(2:)//trim(name)//' '
         else if (any(exponent(numbers) == maxexponent(numbers))) then
            ! what extremes begin with
            paths = paths//group(2:)//trim(name)//' '
         end if
      end do
   end subroutine look_into_group

   !> Open a file; negative: it cannot be opened.
   function open_file(file) result(handle)
      !> Name of the file
      character(*), intent(in) :: file
      integer(hid_t) :: handle

      integer :: status

      ! each start leaves copies of the library's types behind
      if (.not. is_open) call h5open_f(status)
      is_open = .true.
      call h5eset_auto_f(0, status)
      call h5fopen_f(file, h5f_acc_rdonly_f, handle, status)
      if (status < 0) handle = -1_hid_t
   end function open_file

   !> Look for an object, link by link.
   subroutine find(handle, path, exists)
      !> The open file
      integer(hid_t), intent(in) :: handle
      !> Path of the object, without a leading '/'
      character(*), intent(in) :: path
      !> It is there
      logical, intent(out) :: exists

      integer :: i, status

      exists = .false.
      if (handle < 0_hid_t) return
      do i = 1, len(path)
         if (path(i:i) /= '/') cycle
         call h5lexists_f(handle, path(:i - 1), exists, status)
         if (.not. exists) return
      end do
      call h5lexists_f(handle, path, exists, status)
   end subroutine find

   !> Look for an attribute.
   subroutine find_attribute(handle, path, name, exists)
      !> The open file
      integer(hid_t), intent(in) :: handle
      !> Path of the object, '/' for the file itself
      character(*), intent(in) :: path
      !> Name of the attribute
      character(*), intent(in) :: name
      !> It is there
      logical, intent(out) :: exists

      integer :: status

      if (path == '/') then
         exists = handle >= 0_hid_t
      else
         call find(handle, path, exists)
      end if
      if (exists) call h5aexists_by_name_f(handle, path, name, exists, status)
   end subroutine find_attribute

   !> A text as C keeps it.
   function text_at(address) result(text)
      !> Its first character
      type(c_ptr), intent(in) :: address
      character(:), allocatable :: text

      integer, parameter :: longest = 100001
      character(kind=c_char), pointer :: characters(:)
      integer :: i, length

      text = ''
      if (.not. c_associated(address)) return
      call c_f_pointer(address, characters, [longest])
      do length = 0, longest - 1
         if (characters(length + 1) == c_null_char) exit
      end do
      text = repeat(' ', length)
      do i = 1, length
         text(i:i) = characters(i)
      end do
   end function text_at

end module hdf5_reading
