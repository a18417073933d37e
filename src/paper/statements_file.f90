!> The results file of the statements, and the same as text.
module statements_file
   use, intrinsic :: iso_c_binding, only: c_char, c_size_t
   use failures, only: fail, failure_t, status_run_failed
   use file_system, only: make_folder, replace_file
   use hdf5_writing, only: hdf5_image_t
   use paper_cases, only: way_count, way_t
   use results_file, only: begin_results, finish_results
   use scene_types, only: scene_t
   use statement_types, only: statements_t, verdict_in_words
   use statements_tables, only: print_statements
   implicit none (type, external)
   private
   public :: write_statements

   integer, parameter :: text_room = 500

contains

   !> Write the file, whole or not at all.
   subroutine write_statements(folder, version, scene, ways, list, error)
      !> Folder of the results
      character(*), intent(in) :: folder
      !> Version of the program
      character(*), intent(in) :: version
      !> The scene
      type(scene_t), intent(in) :: scene
      !> The ways
      type(way_t), intent(in) :: ways(way_count)
      !> The statements
      type(statements_t), intent(in) :: list
      !> Why the file could not be written
      type(failure_t), allocatable, intent(out) :: error

      integer(c_size_t), parameter :: expected_bytes = 262144_c_size_t
      type(hdf5_image_t) :: image
      character(text_room), dimension(size(list%item)) :: text, measure, detail, reason, verdict
      integer :: i

      call make_folder(folder, error)
      if (allocated(error)) return
      call begin_results(image, expected_bytes, version, scene)
      call image%begin_group('statements')
      do i = 1, size(list%item)
         text(i) = list%item(i)%text
         measure(i) = list%item(i)%measure
         detail(i) = list%item(i)%detail
         reason(i) = list%item(i)%reason
         verdict(i) = verdict_in_words(list%item(i))
      end do
      call image%add('statement', [(i, i=1, size(list%item))], '1', 'one statement of the paper', is_scale=.true.)
      call image%add('way', [(i, i=1, way_count)], '1', 'one way of computing', is_scale=.true.)
      call image%add('way_name', ways%name, 'none', 'name of the way', along='way')
      call image%add('label', list%item%label, 'none', 'number of the statement', along='statement')
      call image%add('text', text, 'none', 'what the paper says', along='statement')
      call image%add('measure', measure, 'none', 'what was measured, and the condition on it', along='statement')
      call image%add('detail', detail, 'none', 'the numbers behind it, exact motion on the fine mesh', along='statement')
      call image%add('reason', reason, 'none', 'why the paper and the program differ', along='statement')
      call image%add('verdict', verdict, 'none', &
                     'verdict', along='statement')
      call image%add('definitions_agreeing', list%item%agreeing, '1', &
                     'definitions of the end with the same verdict; 0: the end has no part in it', along='statement')
      do i = 1, way_count
         call image%add(name_of('figure', i), list%item%figure(i), '1', 'figure that decides: '//trim(ways(i)%name), &
                        along='statement')
         call image%add(name_of('holds', i), merge(1, 0, list%item%holds(i)), '1', 'condition met: '//trim(ways(i)%name), &
                        along='statement')
      end do
      call image%end_group()
      call finish_results(image, folder, scene, error)
      if (allocated(error)) return
      call write_text(folder, scene%name//'.txt', ways, list, error)
   end subroutine write_statements

   !> The table as a file of its own.
   subroutine write_text(folder, name, ways, list, error)
      !> Folder of the results
      character(*), intent(in) :: folder
      !> Name of the file
      character(*), intent(in) :: name
      !> The ways
      type(way_t), intent(in) :: ways(way_count)
      !> The statements
      type(statements_t), intent(in) :: list
      !> Why the file could not be written
      type(failure_t), allocatable, intent(inout) :: error

      integer, parameter :: longest_line = 200
      character(:), allocatable :: text
      character(longest_line) :: line
      character(kind=c_char), allocatable :: bytes(:)
      integer :: unit, status, i

      open (newunit=unit, status='scratch', action='readwrite', iostat=status)
      if (status /= 0) then
         call fail(error, status_run_failed, 'cannot open a scratch file for '//name)
         return
      end if
      call print_statements(unit, ways, list)
      rewind (unit)
      text = ''
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         text = text//trim(line)//new_line('a')
      end do
      close (unit)
      allocate (bytes(len(text)))
      do i = 1, len(text)
         bytes(i) = text(i:i)
      end do
      call replace_file(folder, name, bytes, error)
   end subroutine write_text

   !> A name with a number.
   pure function name_of(name, index) result(text)
      !> The name
      character(*), intent(in) :: name
      !> The number
      integer, intent(in) :: index
      character(:), allocatable :: text

      text = name//'_'//achar(iachar('0') + index)
   end function name_of

end module statements_file
